#include <ctime>

#include "shared/replica.h"
#include "sim/distributed_world.h"

namespace sim {
namespace {

double clock_s(clockid_t clock) {
    timespec now{};
    clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// One step, timed by the wall and by this thread's processor time.
void timed_step(World& world, DistributedResult& result, WorkerStep& told) {
    const double wall = clock_s(CLOCK_MONOTONIC), cpu = clock_s(CLOCK_THREAD_CPUTIME_ID);
    world.step();
    told.seconds = clock_s(CLOCK_MONOTONIC) - wall;
    result.elapsed_s += told.seconds;
    result.cpu_s += clock_s(CLOCK_THREAD_CPUTIME_ID) - cpu;
    told.step = ++result.steps;
    told.bodies = world.bodies();
}

}  // namespace

DistributedResult run_alone(const WorldScene& scene, const DistributedSettings& settings,
                            DistributedObserver& observer) {
    World world(scene.world);
    SceneClock clock(scene);
    DistributedResult result;
    WorkerStep told;
    const auto rests = [&] { return !clock.events_left() && world.all_asleep(); };
    observer.at(0, world);
    for (; result.steps < settings.steps; observer.at(result.steps, world)) {
        clock.apply(world, result.steps);
        observer.ready(result.steps, world);
        if (settings.until_rest && rests()) break;
        timed_step(world, result, told);
        observer.worked(told);
    }
    observer.ready(result.steps, world);
    result.rest_reached = rests();
    result.outside_impulse = world.outside_impulse();
    result.counts = world.counts();
    result.quarantined = world.quarantined();
    result.limited = world.limited(), result.broken = world.broken();
    return result;
}

}  // namespace sim
