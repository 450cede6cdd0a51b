#include "bench/measured_run.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>

#include "simulate/run_measures.h"

namespace app {
namespace {

/// Keeps what is told, the momentum and the mean height.
class BodiesWatch : public sim::DistributedObserver {
public:
    BodiesWatch(MeasuredRun& run, const sim::WorldScene& scene, const sim::DistributedSettings& settings)
        : run_(run),
          scene_(scene),
          last_(settings.steps),
          second_(std::uint64_t(std::lround(1 / scene.world.settings.dt))) {}

    void at(std::uint64_t step, const sim::World& world) override {
        if (step > 0) run_.body_steps += std::uint64_t(world.bodies());
        if (step == 0) momentum_.emplace(scene_, world);
        if (step % 10 == 0 || step == last_) momentum_->look(world);
        for (int body = 0; body < world.bodies(); ++body) {
            const Eigen::Vector3d centre = world.state(body).position;
            if (step == std::min(second_, last_)) run_.after_a_second.push_back(centre);
            if (step == last_) run_.mean_height += centre.y() / world.bodies();
        }
    }
    void worked(const sim::WorkerStep& step) override {
        run_.steps.push_back(step);
        run_.history.add(step);
    }
    void moved(std::uint64_t step, int bodies, int from, int to) override {
        run_.trades.push_back({step, bodies, from, to});
    }
    /// The drift of the momentum; `outside`: the impulse of what is no body.
    [[nodiscard]] MomentumDrift drift(const std::optional<Eigen::Vector3d>& outside) const {
        return momentum_->drift(outside).value();
    }

private:
    MeasuredRun& run_;
    const sim::WorldScene& scene_;
    std::uint64_t last_, second_;
    std::optional<MomentumWatch> momentum_;
};

template <typename Start>
MeasuredRun measure(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                    const Start& start) {
    MeasuredRun run;
    BodiesWatch watch(run, scene, settings);
    run.result = start(watch);
    run.momentum_drift = watch.drift(run.result.outside_impulse).share();
    return run;
}

}  // namespace

double MeasuredRun::with_barrier_s() const {
    std::map<std::uint64_t, double> longest;
    for (const sim::WorkerStep& s : steps) longest[s.step] = std::max(longest[s.step], s.seconds);
    return std::accumulate(longest.begin(), longest.end(), 0.0,
                           [](double sum, const auto& step) { return sum + step.second; });
}

MeasuredRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                        const sim::SimulatedProcessors& processors) {
    return measure(scene, settings, [&](sim::DistributedObserver& observer) {
        return sim::simulate_processors(scene, settings, processors, observer);
    });
}

MeasuredRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                        const sim::DistributedLaunch& launch) {
    return measure(scene, settings, [&](sim::DistributedObserver& observer) {
        return sim::run_distributed(scene, settings, launch, observer);
    });
}

sim::WorldDefinition strip_of(const sim::WorldDefinition& world, int number, int of) {
    std::vector<std::size_t> order(world.bodies.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto x = [&](std::size_t body) { return world.bodies[body].world_from_body.translation().x(); };
    std::sort(order.begin(), order.end(),
              [&](std::size_t a, std::size_t b) { return x(a) != x(b) ? x(a) < x(b) : a < b; });
    const auto border = [&](int k) { return order.size() * std::size_t(k) / std::size_t(of); };
    const std::size_t first = border(number), end = border(number + 1);

    sim::WorldDefinition strip;
    strip.settings = world.settings;
    strip.planes = world.planes;
    std::map<int, int> number_of;
    for (std::size_t k = first; k < end; ++k) {
        number_of[static_cast<int>(order[k])] = static_cast<int>(strip.bodies.size());
        strip.bodies.push_back(world.bodies[order[k]]);
    }
    // Half-way to the neighbour, but not through the strip's own bodies.
    const auto wall = [&](std::size_t at, double side) {
        double offset = side * 0.5 * (x(order[at - 1]) + x(order[at]));
        for (const sim::WorldBody& body : strip.bodies)
            offset = std::min(
                offset, side * body.world_from_body.translation().x() - body.shape.base.semi_axes.maxCoeff());
        strip.planes.push_back({side * Eigen::Vector3d::UnitX(), offset});
    };
    if (number > 0) wall(first, 1);
    if (number + 1 < of) wall(end, -1);
    for (sim::PointConstraint c : world.constraints) {
        if (!number_of.contains(c.body_a) || (c.body_b >= 0 && !number_of.contains(c.body_b))) continue;
        c.body_a = number_of[c.body_a];
        if (c.body_b >= 0) c.body_b = number_of[c.body_b];
        strip.constraints.push_back(c);
    }
    return strip;
}

double unevenness_at(const MeasuredRun& run, std::uint64_t step) {
    std::map<int, sim::WorkerStep> now;
    for (const auto& [worker, points] : run.history.workers()) now[worker] = {};
    for (const sim::WorkerStep& done : run.steps) {
        now[done.worker] = done;
        if (std::ranges::all_of(now, [&](const auto& n) { return n.second.step >= step; })) break;
    }
    double sum = 0, per_body = 0, worst = 0;
    for (const auto& [worker, last] : now) {
        sum += last.smoothed_s;
        if (last.bodies > 0) per_body = std::max(per_body, last.smoothed_s / last.bodies);
    }
    const double average = sum / static_cast<double>(now.size());
    for (const auto& [worker, last] : now) worst = std::max(worst, std::abs(last.smoothed_s - average));
    const double allowed = std::max(0.15 * average, per_body);
    return allowed > 0 ? worst / allowed : 0;
}

int most_trades(const MeasuredRun& run, std::uint64_t from, std::uint64_t to, std::uint64_t window) {
    const auto in_window = [&](std::uint64_t first) {
        return std::ranges::count_if(run.trades, [&](const MeasuredRun::Trade& trade) {
            return trade.step >= first && trade.step < std::min(first + window, to);
        });
    };
    int most = 0;
    for (const MeasuredRun::Trade& first : run.trades)
        if (first.step >= from && first.step < to)
            most = std::max(most, static_cast<int>(in_window(first.step)));
    return most;
}

}  // namespace app
