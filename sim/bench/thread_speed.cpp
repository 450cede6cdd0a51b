#include "thread_speed.h"

#include <algorithm>
#include <chrono>

#include "run/elapsed_time.h"

namespace sim_bench {
namespace {

constexpr int kTurn = 25;  // steps

double median_of(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return values.empty() ? 0 : *middle;
}

/// A world with so many threads.
struct Threaded {
    Threaded(const sim::WorldDefinition& definition, int threads) : world(definition), sum{threads} {
        world.use_threads(threads);
    }
    void step(int steps) {
        const auto start = std::chrono::steady_clock::now();
        const double all = sim::process_processor_s();
        for (int i = 0; i < steps; ++i) world.step();
        sum.elapsed_s += sim::seconds_since(start);
        sum.cpu_s += sim::process_processor_s() - all;
    }

    sim::World world;
    ThreadsSpeed sum;
};

std::vector<ThreadsSpeed> one_round(const sim::WorldDefinition& definition, const std::vector<int>& threads,
                                    int steps) {
    std::vector<Threaded> worlds;
    for (const int count : threads) worlds.emplace_back(definition, count);
    for (int done = 0; done < steps; done += kTurn)
        for (Threaded& one : worlds) one.step(std::min(kTurn, steps - done));
    std::vector<ThreadsSpeed> sums;
    for (const Threaded& one : worlds) sums.push_back(one.sum);
    return sums;
}

}  // namespace

std::vector<ThreadsSpeed> measure_threads(const sim::WorldDefinition& world, const std::vector<int>& threads,
                                          int steps, int rounds) {
    std::vector<std::vector<ThreadsSpeed>> all;
    for (int i = 0; i < rounds; ++i) all.push_back(one_round(world, threads, steps));
    std::vector<ThreadsSpeed> medians;
    for (std::size_t i = 0; i < threads.size(); ++i) {
        const auto median = [&](double ThreadsSpeed::*of) {
            std::vector<double> values;
            for (const std::vector<ThreadsSpeed>& round : all) values.push_back(round[i].*of);
            return median_of(std::move(values));
        };
        medians.push_back({threads[i], median(&ThreadsSpeed::elapsed_s), median(&ThreadsSpeed::cpu_s)});
    }
    return medians;
}

}  // namespace sim_bench
