#include <algorithm>
#include <cmath>

#include "world/world_implementation.h"

// Forces that a scene's schedule applies.

namespace sim {
namespace {

constexpr double kSlack = 1e-6;  // of a substep: times are not exact

int body_of(const ActiveForce& active) {
    return active.force->body;
}

}  // namespace

void World::Implementation::find_forces() {
    active.clear();
    const double substep = settings.dt / settings.substeps;
    const double begins = static_cast<double>(counts.steps - 1) * settings.substeps,
                 ends = begins + settings.substeps;
    for (const TimedForce& force : forces) {
        ActiveForce now{&force, force.from_s / substep, force.until_s / substep, 1};
        if (force.from_s == force.until_s) {
            now.from = std::floor(now.from + kSlack), now.until = now.from + 1;
            now.factor = 1 / substep;
        }
        if (now.from >= ends || now.until <= begins || force.body >= static_cast<int>(bodies.size()))
            continue;
        const MovingBody& body = bodies[static_cast<std::size_t>(force.body)];
        if (!body.moves()) continue;
        active.push_back(now);
        if (body.asleep && (body.own || !shared)) wake_group(bodies, force.body);
    }
    for (const auto& solver : solvers) solver->begin_step(counts.steps - 1, active);
}

bool World::Implementation::is_forced(int body) const {
    return std::ranges::binary_search(active, body, {}, body_of);
}

}  // namespace sim
