#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>

#include "render/renderer.h"

namespace {

const std::string kMeshFolder = MUSICWORLD_SOURCE_DIR "/assets/meshes/";

render::SceneDescription small_kit() {
    render::SceneDescription scene;
    for (const char* name : {"drum", "cymbal", "stick", "stand"})
        scene.objects.push_back({name, kMeshFolder + name + ".obj", {}});
    scene.objects[1].look.body = {{0.8f, 0.5f, 0.2f}, 1, 0.3f, 0.8f};
    scene.width = 240;
    scene.height = 180;
    return scene;
}

render::FrameState pose(float x) {
    const Eigen::Affine3f drum = Eigen::Translation3f(x, 0.6f, -0.2f) * Eigen::Scaling(0.2f, 0.15f, 0.2f);
    const Eigen::Affine3f cymbal =
        Eigen::Translation3f(0.4f, 1.0f, -0.4f) * Eigen::Scaling(0.25f, 0.03f, 0.25f);
    const Eigen::Affine3f stick(Eigen::Translation3f(-0.1f, 0.9f, 0.2f));
    const Eigen::Affine3f stand(Eigen::Translation3f(0.4f, 1.0f, -0.4f));
    return {{drum.matrix(), cymbal.matrix(), stick.matrix(), stand.matrix()}, {true, true, true, true}};
}

/// FNV-1a, 64 bits.
std::uint64_t hash(const render::Image& image) {
    std::uint64_t value = 14695981039346656037u;
    for (const std::uint8_t byte : image.rgb) value = (value ^ byte) * 1099511628211u;
    return value;
}

TEST(Repeatability, TheSameStateGivesTheSameBytesWhateverWasDrawnBeforeAndInANewRenderer) {
    render::Renderer first(small_kit()), second(small_kit());
    render::Image a, b, c, other;
    first.draw(pose(0), a);
    first.draw(pose(0.3f), other);
    first.draw(pose(0), b);
    second.draw(pose(0), c);
    EXPECT_TRUE(a.rgb == b.rgb);
    EXPECT_TRUE(a.rgb == c.rgb);
    EXPECT_FALSE(a.rgb == other.rgb);
}

TEST(Repeatability, TheVersionNamesTheRasteriser) {
    render::Renderer renderer(small_kit());
    EXPECT_NE(renderer.version().find("OSMesa"), std::string::npos);
    EXPECT_NE(renderer.version().find("OpenGL"), std::string::npos);
    EXPECT_GT(renderer.triangles(), 1000u);
}

/// Not a test of its own: run in processes of their own by the tests below, since the rasteriser reads its
/// number of threads once, and each back end brings an OpenGL of its own.
TEST(Repeatability, DISABLED_PrintsAHash) {
    render::Renderer renderer(small_kit());
    render::Image image;
    renderer.draw(pose(0.1f), image);
    std::printf("version=%s\nhash=%llu\n", renderer.version().c_str(),
                static_cast<unsigned long long>(hash(image)));
}

/// What that prints, with variables set ("A=1 B=2"); the exit status is 0 where it succeeds.
std::pair<std::string, int> printed_with(const std::string& variables) {
    const std::string command =
        variables + " '" + std::filesystem::read_symlink("/proc/self/exe").string() +
        "' --gtest_also_run_disabled_tests --gtest_filter=Repeatability.DISABLED_PrintsAHash";
    std::FILE* pipe = popen(command.c_str(), "r");
    std::string output;
    std::array<char, 4096> block;
    while (const std::size_t count = std::fread(block.data(), 1, block.size(), pipe))
        output.append(block.data(), count);
    return {output, pclose(pipe)};
}

std::string hash_in(const std::string& output) {
    const std::size_t start = output.find("hash=");
    return start == std::string::npos ? "" : output.substr(start, output.find('\n', start) - start);
}

std::string hash_with_threads(int threads) {
    const auto [output, status] = printed_with("LP_NUM_THREADS=" + std::to_string(threads));
    EXPECT_EQ(status, 0) << output;
    return hash_in(output);
}

TEST(Repeatability, NoOneOrTwoRasteriserThreadsGiveTheSameBytes) {
    const std::string none = hash_with_threads(0);
    EXPECT_NE(none, "");
    EXPECT_EQ(hash_with_threads(1), none);
    EXPECT_EQ(hash_with_threads(2), none);
}

TEST(Repeatability, EglGivesTheSameBytesAsOsmesaWhereBothDrawInSoftware) {
    const auto [output, status] = printed_with("MUSICWORLD_GL=egl");
    ASSERT_EQ(status, 0) << output;
    EXPECT_NE(output.find("version=EGL, OpenGL"), std::string::npos) << output;
    EXPECT_NE(hash_in(output), "");
    if (output.find("llvmpipe") == std::string::npos) GTEST_SKIP() << "EGL draws with another renderer";
    EXPECT_EQ(hash_in(output), hash_in(printed_with("MUSICWORLD_GL=osmesa").first));
}

TEST(Repeatability, AnUnknownBackEndIsRefusedAndNamed) {
    const auto [output, status] = printed_with("MUSICWORLD_GL=glx");
    EXPECT_NE(status, 0);
    EXPECT_NE(output.find("MUSICWORLD_GL: error: found \"glx\", expected osmesa or egl"), std::string::npos)
        << output;
}

}  // namespace
