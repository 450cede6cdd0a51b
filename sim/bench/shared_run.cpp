#include "shared_run.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace sim_bench {
namespace {

class Watch : public sim::DistributedObserver {
public:
    Watch(SharedRun& run, const sim::WorldScene& scene, const sim::DistributedSettings& settings,
          sim::DistributedObserver* also)
        : run_(run),
          also_(also),
          last_(settings.steps),
          second_(std::uint64_t(std::lround(1 / scene.world.settings.dt))) {}

    void at(std::uint64_t step, const sim::World& world) override {
        if (also_) also_->at(step, world);
        if (step > 0) run_.body_steps += std::uint64_t(world.bodies());
        for (int body = 0; body < world.bodies(); ++body) {
            const Eigen::Vector3d centre = world.state(body).position;
            if (step == std::min(second_, last_)) run_.after_a_second.push_back(centre);
            if (step == last_) run_.mean_height += centre.y() / world.bodies();
        }
    }
    void worked(const sim::WorkerStep& step) override { run_.steps.push_back(step); }
    void moved(std::uint64_t step, int bodies, int from, int to) override {
        run_.trades.push_back({step, bodies, from, to});
    }

private:
    SharedRun& run_;
    sim::DistributedObserver* also_;
    std::uint64_t last_, second_;
};

template <typename Start>
SharedRun measure(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                  sim::DistributedObserver* also, const Start& start) {
    SharedRun run;
    Watch watch(run, scene, settings, also);
    run.result = start(watch);
    return run;
}

// A number in [0, 1), the same in every run.
double drawn(std::uint64_t a, std::uint64_t b) {
    std::uint64_t x = a * 0x9e3779b97f4a7c15u + b * 0xbf58476d1ce4e5b9u + 1992;  // splitmix64
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

}  // namespace

double SharedRun::critical_path_s(int lead) const {
    std::map<std::uint64_t, std::map<int, double>> costs;
    for (const sim::WorkerStep& s : steps) {
        double& cost = costs[s.step][s.worker];  // if a step is reported twice, the longer time
        cost = std::max(cost, s.processor_s);
    }
    std::map<int, double> ended;    // by each worker's last step
    std::vector<double> all = {0};  // when all had ended each step
    for (const auto& [step, workers] : costs) {
        const std::size_t before = all.size() - 1, late = static_cast<std::size_t>(lead);
        const double free = all[before > late ? before - late : 0];
        double last = all.back();
        for (const auto& [worker, cost] : workers) {
            ended[worker] = std::max(ended[worker], free) + cost;
            last = std::max(last, ended[worker]);
        }
        all.push_back(last);
    }
    return all.back();
}

SharedRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                      const SimulatedProcessors& processors, sim::DistributedObserver* also) {
    return measure(scene, settings, also, [&](sim::DistributedObserver& observer) {
        return simulate_processors(scene, settings, processors, observer);
    });
}

SharedRun measure_run(const sim::WorldScene& scene, const sim::DistributedSettings& settings,
                      const sim::DistributedLaunch& launch) {
    return measure(scene, settings, nullptr, [&](sim::DistributedObserver& observer) {
        return SimulatedResult{sim::run_distributed(scene, settings, launch, observer)};
    });
}

SharedRun measure_alone(const sim::WorldScene& scene, const sim::DistributedSettings& settings) {
    return measure(scene, settings, nullptr, [&](sim::DistributedObserver& observer) {
        return SimulatedResult{sim::run_alone(scene, settings, observer)};
    });
}

double unevenness_at(const SharedRun& run, std::uint64_t step) {
    std::map<int, sim::WorkerStep> now;
    for (const sim::WorkerStep& done : run.steps) now[done.worker] = {};
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

int most_trades(const SharedRun& run, std::uint64_t from, std::uint64_t to, std::uint64_t window) {
    const auto in_window = [&](std::uint64_t first) {
        return std::ranges::count_if(run.trades, [&](const SharedRun::Trade& trade) {
            return trade.step >= first && trade.step < std::min(first + window, to);
        });
    };
    int most = 0;
    for (const SharedRun::Trade& first : run.trades)
        if (first.step >= from && first.step < to)
            most = std::max(most, static_cast<int>(in_window(first.step)));
    return most;
}

double apart(const SharedRun& a, const SharedRun& b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.after_a_second.size(); ++k)
        sum += (a.after_a_second[k] - b.after_a_second[k]).squaredNorm();
    return a.after_a_second.empty() ? 0 : std::sqrt(sum / static_cast<double>(a.after_a_second.size()));
}

double unsteady(int worker, std::uint64_t step) {
    return drawn(std::uint64_t(worker), step) < 0.2 ? 2 : 1;
}

double wandering(int workers, int worker, std::uint64_t step) {
    return worker == static_cast<int>(drawn(step / 20, 7) * workers) ? 2 : 1;
}

}  // namespace sim_bench
