// Checkpoints of simulate: every scene goes on from them to the bit, and no bytes harm their reader.
#include "simulate/checkpoint.h"

#include <gtest/gtest.h>
#include <sim/distributed_world.h>

#include <cstring>
#include <limits>
#include <map>
#include <random>

#include "damaged_bytes.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/checksum.h"
#include "scene/scene.h"
#include "shared_folder.h"
#include "temporary_folder.h"

namespace app {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

struct Seen : sim::DistributedObserver {
    void at(std::uint64_t step, const sim::World& world) override { hashes[step] = world.state_hash(); }
    void done(std::uint64_t step, const std::function<sim::RunState()>& state) override {
        if (save.contains(step)) save[step] = sim::encode(state());
    }
    std::map<std::uint64_t, std::uint64_t> hashes;
    std::map<std::uint64_t, Bytes> save;
};

/// From a third of the steps, and two thirds, every later step has the bits of the undisturbed run.
void expect_same_after_resume(const fs::path& file, std::uint64_t steps) {
    SCOPED_TRACE(file.string());
    const Scene scene = read_scene(file);
    sim::DistributedSettings settings;
    settings.steps = steps;
    Seen whole;
    whole.save = {{steps / 3, {}}, {2 * steps / 3, {}}};
    (void)sim::run_alone(scene, settings, whole);
    for (const auto& [step, bytes] : whole.save) {
        const sim::RunState from = sim::decode_run_state(bytes, scene);
        Seen after;
        (void)sim::run_alone(scene, settings, after, &from);
        EXPECT_EQ(after.hashes.size(), 2 + steps - step);
        for (const auto& [later, hash] : after.hashes)
            ASSERT_EQ(hash, whole.hashes.at(later)) << "from step " << step << " at " << later;
    }
}

void expect_same_of_all(const fs::path& folder) {
    for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
        if (entry.path().extension() != ".toml") continue;
        const std::string name = entry.path().stem();
        const bool large = name == "benchmark1600" || name == "benchmark400";
        expect_same_after_resume(entry.path(), large ? 6 : 150);
        if (testing::Test::HasFatalFailure()) return;
    }
}

TEST(Checkpoint, EveryBundledSceneGoesOnWithTheBitsOfTheUndisturbedRun) {
    expect_same_of_all(assets_folder() / "scenes");
}

TEST(Checkpoint, EveryHardSceneGoesOnWithTheBitsOfTheUndisturbedRun) {
    expect_same_of_all(assets_folder() / "scenes" / "hard");
}

TEST(Checkpoint, EveryHardSceneOfOthersGoesOnWithTheBitsOfTheUndisturbedRun) {
    const auto shared = shared_folder();
    if (!shared || !fs::is_directory(*shared / "hard_scenes")) GTEST_SKIP() << "no folder of others' scenes";
    expect_same_of_all(*shared / "hard_scenes");
}

Checkpoint some() {
    Checkpoint c;
    c.words = {"sc\xffne.toml", "--steps=3"};  // names need not be UTF-8
    c.directory = "/somewhere";
    c.version = "1", c.build = "2", c.scene_sha256 = "3";
    c.record.table_bytes = {1, 2, ~std::uint64_t{0}};
    c.record.next_frame = 7, c.record.body_steps = 8;
    c.record.momentum = {0.1, std::numeric_limits<double>::infinity(), -0.0};
    c.record.spun = {{3, 4}};
    c.record.wall_s = 1.0 / 3;
    c.state = Bytes(300, 9);
    return c;
}

TEST(Checkpoint, AFileReadsBackToTheSameBytes) {
    const TemporaryFolder folder;
    const Bytes bytes = format_checkpoint(some());
    const fs::path file = folder.write("checkpoint", {bytes.begin(), bytes.end()});
    const Checkpoint back = read_checkpoint(file);
    EXPECT_EQ(format_checkpoint(back), bytes);
    EXPECT_EQ(back.words, some().words);
    EXPECT_EQ(back.record.momentum.angular, some().record.momentum.angular);
}

TEST(Checkpoint, DamagedFilesAreRefusedWithTheirPlaceAlsoWhereTheChecksumIsRight) {
    const TemporaryFolder folder;
    const Bytes good = format_checkpoint(some());
    std::mt19937 random(3);
    constexpr int kMutations = 6000;
    int refused = 0;
    for (int i = 0; i < kMutations; ++i) {
        Bytes bad = damaged(good, random);
        if (bad == good) continue;
        const bool mended = i % 8 >= 4 && bad.size() > 8;
        if (mended) {
            const std::uint64_t sum = fnv1a_64(std::span(bad).first(bad.size() - 8));
            std::memcpy(bad.data() + bad.size() - 8, &sum, 8);
        }
        try {
            (void)read_checkpoint(folder.write("checkpoint", {bad.begin(), bad.end()}));
            EXPECT_TRUE(mended) << i;
        } catch (const BadInput& wrong) {
            const std::string what = wrong.what();
            EXPECT_NE(what.find("checkpoint:byte "), std::string::npos) << what;
            EXPECT_NE(what.find("expected"), std::string::npos) << what;
            EXPECT_EQ(what.find('\n'), std::string::npos) << what;
            ++refused;
        }
    }
    EXPECT_GT(refused, kMutations / 2);
}

}  // namespace
}  // namespace app
