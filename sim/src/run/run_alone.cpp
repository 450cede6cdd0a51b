#include <chrono>

#include "run/elapsed_time.h"
#include "run/scene_clock.h"
#include "sim/distributed_world.h"

namespace sim {
namespace {

/// One step, timed by the wall and by this thread's processor time.
void timed_step(World& world, DistributedResult& result, WorkerStep& report) {
    const auto start = std::chrono::steady_clock::now();
    const double cpu = thread_processor_s();
    world.step();
    report.seconds = seconds_since(start);
    report.processor_s = thread_processor_s() - cpu;
    result.elapsed_s += report.seconds;
    result.cpu_s += report.processor_s;
    report.step = ++result.steps;
    report.bodies = world.bodies();
}

void report_mishaps(const World& world, DistributedResult& result) {
    result.outside_impulse = world.outside_impulse();
    result.counts = world.counts();
    result.quarantined = world.quarantined();
    result.limited = world.limited(), result.broken = world.broken();
}

RunState state_of(const World& world, const DistributedResult& result) {
    RunState state{world.snapshot(), result};
    report_mishaps(world, state.result);
    return state;
}

void go_to(const RunState& from, World& world, SceneClock& clock) {
    clock.apply(world, from.world.step - 1);
    world.rewind(from.world);
    const DistributedResult& r = from.result;
    world.recall({r.counts, r.quarantined, r.limited, r.broken});
}

}  // namespace

DistributedResult run_alone(const WorldScene& scene, const DistributedSettings& settings,
                            DistributedObserver& observer, const RunState* from, int threads) {
    World world(scene.world);
    world.use_threads(threads);
    SceneClock clock(scene);
    DistributedResult result;
    WorkerStep report;
    const auto rests = [&] { return !clock.events_left() && world.all_asleep(); };
    observer.at(0, world);
    if (from) {
        go_to(*from, world, clock);
        result = from->result;
        observer.at(result.steps, world);
    }
    while (result.steps < settings.steps) {
        clock.apply(world, result.steps);
        observer.ready(result.steps, world);
        if (settings.until_rest && rests()) break;
        timed_step(world, result, report);
        observer.worked(report);
        observer.done(result.steps, [&] { return state_of(world, result); });
        observer.at(result.steps, world);
    }
    observer.ready(result.steps, world);
    result.rest_reached = rests();
    report_mishaps(world, result);
    return result;
}

}  // namespace sim
