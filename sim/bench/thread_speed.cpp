#include "thread_speed.h"

#include <algorithm>

#include "bench_clock.h"

namespace sim_bench {
namespace {

constexpr int kTurn = 25;  // steps

/// A world with so many threads, and the same with them planned.
struct Pair {
    Pair(const sim::WorldDefinition& definition, int threads)
        : threaded(definition), planned(definition), sum{threads} {
        threaded.use_threads(threads);
        planned.plan_threads(threads);
    }
    void step(int steps) {
        const double wall = wall_s(), all = process_cpu_s();
        for (int i = 0; i < steps; ++i) threaded.step();
        sum.elapsed_s += wall_s() - wall;
        sum.cpu_s += process_cpu_s() - all;
        const double cpu = thread_cpu_s(), saved = planned.saved_by_threads_s();
        for (int i = 0; i < steps; ++i) planned.step();
        sum.critical_path_s += thread_cpu_s() - cpu - (planned.saved_by_threads_s() - saved);
    }

    sim::World threaded, planned;
    ThreadsSpeed sum;
};

std::vector<ThreadsSpeed> one_round(const sim::WorldDefinition& definition, const std::vector<int>& threads,
                                    int steps) {
    std::vector<Pair> pairs;
    for (const int count : threads) pairs.emplace_back(definition, count);
    for (int done = 0; done < steps; done += kTurn)
        for (Pair& pair : pairs) pair.step(std::min(kTurn, steps - done));
    std::vector<ThreadsSpeed> sums;
    for (const Pair& pair : pairs) sums.push_back(pair.sum);
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
        medians.push_back({threads[i], median(&ThreadsSpeed::elapsed_s),
                           median(&ThreadsSpeed::critical_path_s), median(&ThreadsSpeed::cpu_s)});
    }
    return medians;
}

}  // namespace sim_bench
