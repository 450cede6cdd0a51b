// simulate --threads: every bundled scene has the bits of one thread, also when it goes on from a checkpoint with another number.
#include <gtest/gtest.h>
#include <sim/distributed_world.h>

#include <map>

#include "files/assets.h"
#include "files/bad_input.h"
#include "scene/scene.h"
#include "simulate/simulate.h"

namespace app {
namespace {

namespace fs = std::filesystem;

struct HalfWay : sim::DistributedObserver {
    explicit HalfWay(std::uint64_t step) : saved_at(step) {}
    void at(std::uint64_t step, const sim::World& world) override { hashes[step] = world.state_hash(); }
    void done(std::uint64_t step, const std::function<sim::RunState()>& state) override {
        if (step == saved_at) saved = sim::encode(state());
    }
    std::uint64_t saved_at;
    std::vector<std::uint8_t> saved;
    std::map<std::uint64_t, std::uint64_t> hashes;
};

TEST(SimulateThreads, EveryBundledSceneHasTheBitsOfOneThread) {
    for (const fs::directory_entry& entry : fs::directory_iterator(assets_folder() / "scenes")) {
        if (entry.path().extension() != ".toml") continue;
        SCOPED_TRACE(entry.path().string());
        const Scene scene = read_scene(entry.path());
        sim::DistributedSettings settings;
        // The large benchmarks' balls meet the floor at step 25.
        const std::size_t bodies = scene.world.bodies.size();
        settings.steps = bodies > 1000 ? 32 : bodies > 300 ? 60 : 80;
        const std::uint64_t half = settings.steps / 2;
        HalfWay one(half);
        (void)sim::run_alone(scene, settings, one);
        for (const int threads : {2, 3, 4, 7}) {
            if (bodies > 1000 && threads != 3) continue;  // takes long
            HalfWay seen(half);
            (void)sim::run_alone(scene, settings, seen, nullptr, threads);
            ASSERT_EQ(seen.hashes, one.hashes) << threads << " threads";
            ASSERT_EQ(seen.saved.size(), one.saved.size());
            // On with one thread more than it began with.
            const sim::RunState from = sim::decode_run_state(seen.saved, scene);
            HalfWay after(0);
            (void)sim::run_alone(scene, settings, after, &from, threads + 1);
            for (const auto& [step, hash] : after.hashes) ASSERT_EQ(hash, one.hashes.at(step)) << step;
        }
    }
}

TEST(SimulateThreads, AreRefusedWithoutAWorkerProcessThatStartsHere) {
    SimulateOptions options;
    options.scene = assets_folder() / "scenes" / "joints.toml";
    options.threads = 2;
    options.workers.emplace();
    EXPECT_THROW((void)simulate(options), BadInput);
}

}  // namespace
}  // namespace app
