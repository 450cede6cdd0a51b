// How long a query of a stick's newest state in shared memory takes while a writer publishes at 1 kHz: its
// distribution over single queries, each timed by the processor's time stamp counter. What the two time
// stamps themselves cost is measured the same way, and its median is taken off.
#include <x86intrin.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <memory>
#include <thread>
#include <vector>

#include "tracking/stick_state.h"

namespace {

using std::chrono::steady_clock;
using Newest = tracking::NewestValue<tracking::StickState>;

/// Ticks between two serialised time stamps around `work`.
template <class Work>
std::uint64_t ticks_of(const Work& work) {
    unsigned core;
    _mm_lfence();
    const std::uint64_t begin = __rdtsc();
    _mm_lfence();
    work();
    const std::uint64_t end = __rdtscp(&core);
    _mm_lfence();
    return end - begin;
}

double ns_per_tick() {
    const auto begin = steady_clock::now();
    const std::uint64_t ticks = __rdtsc();
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    const std::chrono::duration<double, std::nano> wall = steady_clock::now() - begin;
    return wall.count() / static_cast<double>(__rdtsc() - ticks);
}

struct Durations {
    const char* name;
    std::vector<std::uint64_t> ticks;

    /// Linear between the order statistics (Hyndman and Fan 1996, definition 7); sorts the ticks.
    [[nodiscard]] double quantile(double p) {
        std::sort(ticks.begin(), ticks.end());
        const double at = p * static_cast<double>(ticks.size() - 1);
        const auto below = static_cast<std::size_t>(at), above = std::min(below + 1, ticks.size() - 1);
        return std::lerp(static_cast<double>(ticks[below]), static_cast<double>(ticks[above]),
                         at - static_cast<double>(below));
    }
    void print(double ns, double overhead) {
        std::printf("%-52s %9zu %7.0f %7.0f %8.0f %10.0f\n", name, ticks.size(),
                    ns * (quantile(0.5) - overhead), ns * (quantile(0.99) - overhead),
                    ns * (quantile(0.999) - overhead), ns * (quantile(1) - overhead));
    }
};

/// `count` queries, each after `wait`.
template <class Wait>
Durations queries(const char* name, const Newest& newest, std::size_t count, const Wait& wait) {
    Durations durations{name, {}};
    durations.ticks.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        wait();
        durations.ticks.push_back(ticks_of([&] {
            const std::optional<tracking::StickState> state = newest.read();
            asm volatile("" : : "r"(&state) : "memory");
        }));
    }
    return durations;
}

Durations empty_queries(std::size_t count) {
    Durations durations{"nothing (the two time stamps)", {}};
    for (std::size_t i = 0; i < count; ++i)
        durations.ticks.push_back(ticks_of([] { asm volatile("" : : : "memory"); }));
    return durations;
}

}  // namespace

int main() {
    const auto newest = std::make_unique<Newest>();
    const std::jthread writer([&newest](const std::stop_token& stop) {
        tracking::StickState state;
        for (auto due = steady_clock::now(); !stop.stop_requested();
             std::this_thread::sleep_until(due += std::chrono::milliseconds(1))) {
            ++state.samples;
            newest->publish(state);
        }
    });
    const double ns = ns_per_tick();
    constexpr std::size_t kMany = 20'000'000, kFew = 10'000;
    std::printf(
        "%zu bytes a state, writer at 1 kHz, %u processors, %.2f ticks a ns\n%-52s %9s %7s %7s %8s %10s\n",
        sizeof(tracking::StickState), std::thread::hardware_concurrency(), 1 / ns, "[ns]", "queries", "p50",
        "p99", "p99.9", "max");
    Durations empty = empty_queries(kMany);
    const double overhead = empty.quantile(0.5);
    empty.print(ns, 0);
    queries("again and again", *newest, kMany, [] {}).print(ns, overhead);
    std::uint64_t seen = 0;
    queries("at once after a publication", *newest, kFew, [&] {
        while (newest->published() == seen) _mm_pause();
        seen = newest->published();
    }).print(ns, overhead);
    queries("after 1 ms of sleep", *newest, kFew, [] {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }).print(ns, overhead);
    return 0;
}
