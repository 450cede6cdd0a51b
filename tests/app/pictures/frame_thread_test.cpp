#include "pictures/frame_thread.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <iterator>

#include "process/clock.h"
#include "temporary_folder.h"

namespace app {
namespace {

namespace fs = std::filesystem;

render::SceneDescription empty_room(int width) {
    render::SceneDescription scene;
    scene.width = width;
    scene.height = width * 3 / 4;
    return scene;
}

render::Image picture(const fs::path& file) {
    std::ifstream in(file, std::ios::binary);
    return render::decode_png({std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()});
}

FrameThreadOptions into(const TemporaryFolder& folder, FramePolicy policy) {
    return {64, 48, folder.path(), policy, false};
}

TEST(FrameThread, OfflineEveryFrameIsDrawnAndWritten) {
    const TemporaryFolder folder;
    FrameThread frames({empty_room(64)}, {}, into(folder, FramePolicy::wait));
    for (std::uint64_t k = 0; k < 40; ++k) EXPECT_TRUE(frames.push({.index = k, .state = {}}));
    frames.finish();
    ASSERT_EQ(frames.report().written.size(), 40U);
    EXPECT_EQ(frames.report().not_written, 0U);
    EXPECT_EQ(picture(folder.path() / "000039.png").rgb, frames.report().rest_image.rgb);
    EXPECT_FALSE(frames.report().version.empty());
    EXPECT_TRUE(frames.take_done().empty());
}

/// Frames 0 and 1 are written before.
TEST(FrameThread, OfflinePicturesThatAreWantedBeforeTheyAreWrittenAreKeptOnce) {
    const TemporaryFolder folder;
    FrameThread frames({empty_room(64)}, {}, into(folder, FramePolicy::wait));
    for (std::uint64_t k = 0; k < 2; ++k) frames.push({.index = k, .state = {}});
    frames.drain();
    EXPECT_TRUE(fs::exists(folder.path() / "000001.png")) << "the last one, too, though none follows";
    frames.keep_pictures({1, 2, 4});
    for (std::uint64_t k = 2; k < 6; ++k) frames.push({.index = k, .state = {}});
    EXPECT_FALSE(frames.take_picture(1));
    const std::optional<render::Image> second = frames.take_picture(2);
    ASSERT_TRUE(second);
    EXPECT_EQ(second->rgb, picture(folder.path() / "000002.png").rgb);
    EXPECT_FALSE(frames.take_picture(2));
    EXPECT_FALSE(frames.take_picture(3)) << "it was not wanted";
    EXPECT_TRUE(frames.take_picture(4));
    frames.finish();
}

/// The first frame is held up until the second has been asked for.
TEST(FrameThread, InRealTimeABusyThreadRefusesAndALateFrameIsDropped) {
    const TemporaryFolder folder;
    FrameThread frames({empty_room(64), empty_room(16)}, {}, into(folder, FramePolicy::refuse));
    EXPECT_EQ(frames.report().trial_s.size(), 2U);
    EXPECT_FALSE(frames.report().priority.empty());
    EXPECT_TRUE(frames.push({.index = 0, .slower_s = 0.2, .state = {}}));
    EXPECT_FALSE(frames.push({.index = 1, .state = {}}));
    std::vector<DrawnFrame> done;
    while (done.empty()) done = frames.take_done();
    ASSERT_EQ(done.size(), 1U);
    EXPECT_TRUE(done[0].in_time);
    EXPECT_GE(done[0].drawn_ns - done[0].started_ns, 200'000'000);
    EXPECT_TRUE(frames.push({.index = 2, .shown_ns = monotonic_ns(), .state = {}}));  // too late
    for (done.clear(); done.empty();) done = frames.take_done();
    EXPECT_FALSE(done[0].in_time);
    EXPECT_TRUE(frames.push({.index = 3, .level = 1, .state = {}}));
    frames.finish();
    done = frames.take_done();
    ASSERT_EQ(done.size(), 1U);
    EXPECT_EQ(done[0].index, 3U);
    EXPECT_EQ(frames.report().written.size(), 2U);
    EXPECT_FALSE(fs::exists(folder.path() / "000002.png"));
    EXPECT_EQ(picture(folder.path() / "000003.png").width, 64) << "a smaller picture is enlarged";
}

TEST(FrameThread, AFolderThatCannotBeWrittenIsSaidByPushOrFinish) {
    const TemporaryFolder folder;
    FrameThread frames({empty_room(16)}, {}, {16, 12, folder.path() / "none", FramePolicy::wait, false});
    EXPECT_THROW(
        {
            for (std::uint64_t k = 0; k < 100; ++k) frames.push({.index = k, .state = {}});
            frames.finish();
        },
        std::runtime_error);
}

TEST(FrameThread, ASceneThatCannotBeLoadedFailsTheStartInRealTime) {
    const TemporaryFolder folder;
    render::SceneDescription scene = empty_room(64);
    scene.objects.push_back({"ghost", folder.path() / "none.obj", {}, -1});
    EXPECT_THROW(FrameThread({scene}, {}, into(folder, FramePolicy::refuse)), std::runtime_error);
}

}  // namespace
}  // namespace app
