#include "bench/bench_sim.h"

#include <bullet_peer.h>
#include <falling_bodies.h>
#include <fmt/format.h>
#include <immintrin.h>
#include <sim/world.h>

#include <algorithm>
#include <cstring>
#include <memory>
#include <vector>

#include "process/clock.h"
#include "statistics/statistics.h"

namespace app {
namespace {

/// What one core of this machine can do at most, measured in a few tenths of a second of processor time.
struct MachineSpeed {
    double flops = 0;  ///< single-precision operations a second, a fused multiply-add counted as two
    double bytes_per_second = 0;  ///< read in order from an array that no cache holds
};

#ifdef __FMA__
using Vector = __m256;
Vector multiply_add(Vector a, Vector b, Vector c) {
    return _mm256_fmadd_ps(a, b, c);
}
#else
using Vector = __m128;
Vector multiply_add(Vector a, Vector b, Vector c) {
    return a * b + c;
}
#endif

constexpr std::size_t kLanes = sizeof(Vector) / sizeof(float);
constexpr std::size_t kChains = 12;  // independent, so that no operation waits for the one before it

struct Chains {
    Vector chain[kChains] = {};
};

float sum_of(const Chains& chains) {
    float sum = 0;
    for (const Vector& v : chains.chain)
        for (std::size_t lane = 0; lane < kLanes; ++lane) sum += v[lane];
    return sum;
}

// Best of several short runs: others' load only ever slows down.
double best_rate(double work, const std::function<float()>& run) {
    double best = 0;
    volatile float kept = 0;
    for (int i = 0; i < 5; ++i) {
        const double begin = thread_cpu_s();
        kept = kept + run();
        best = std::max(best, work / (thread_cpu_s() - begin));
    }
    return best;
}

float multiply_adds(int rounds) {
    Chains chains;
    for (std::size_t i = 0; i < kChains; ++i) chains.chain[i] += 0.1f * static_cast<float>(i);
    const Vector a = Vector{} + 0.999f, b = Vector{} + 0.001f;
    for (int round = 0; round < rounds; ++round)
        for (Vector& v : chains.chain) v = multiply_add(v, a, b);
    return sum_of(chains);
}

float read_all(const std::vector<float>& numbers) {
    Chains chains;
    const Vector one = Vector{} + 1;
    constexpr std::size_t kStride = kChains * kLanes;
    for (std::size_t i = 0; i + kStride <= numbers.size(); i += kStride)
        for (std::size_t k = 0; k < kChains; ++k) {
            Vector read;
            std::memcpy(&read, &numbers[i + k * kLanes], sizeof read);
            chains.chain[k] = multiply_add(read, one, chains.chain[k]);
        }
    return sum_of(chains);
}

MachineSpeed measure_machine_speed() {
    constexpr int kRounds = 2'000'000;
    const std::vector<float> numbers(std::size_t{64} << 20, 1.0f);  // 256 MiB
    return {
        best_rate(2.0 * static_cast<double>(kChains * kLanes) * kRounds,
                  [] { return multiply_adds(kRounds); }),
        best_rate(static_cast<double>(numbers.size() * sizeof(float)), [&] { return read_all(numbers); })};
}

constexpr int kTurn = 25;  // steps
constexpr int kSamples = 182;

/// Milliseconds a step of one round.
struct Round {
    double ours = 0, rigid = 0, reduced = 0;
    double contacts = 0;  ///< of ours, mean over the steps
};

template <typename World>
double timed_ms(World& world, int steps) {
    const double begin = thread_cpu_s();
    for (int i = 0; i < steps; ++i) world.step();
    return 1e3 * (thread_cpu_s() - begin);
}

Round run_round(const sim::WorldDefinition& definition, const SimBenchOptions& options) {
    sim::World ours(definition);
    std::unique_ptr<sim_bench::BulletWorld> rigid, reduced;
    if (sim_bench::bullet_is_there()) {
        rigid = std::make_unique<sim_bench::BulletWorld>(definition, sim_bench::BulletKind::rigid);
        reduced = std::make_unique<sim_bench::BulletWorld>(definition, sim_bench::BulletKind::reduced);
    }
    Round sum;
    for (int done = 0; done < options.steps; done += kTurn) {
        const int steps = std::min(kTurn, options.steps - done);
        sum.ours += timed_ms(ours, steps);
        sum.contacts += ours.counts().contacts * static_cast<double>(steps);
        if (rigid) sum.rigid += timed_ms(*rigid, steps);
        if (reduced) sum.reduced += timed_ms(*reduced, steps);
    }
    const double share = 1.0 / options.steps;
    return {sum.ours * share, sum.rigid * share, sum.reduced * share, sum.contacts * share};
}

double median_over(const std::vector<Round>& rounds, const std::function<double(const Round&)>& value) {
    std::vector<double> values;
    for (const Round& round : rounds) values.push_back(value(round));
    return median(std::move(values));
}

int rounds_for(int bodies, const SimBenchOptions& options) {
    if (options.rounds > 0) return options.rounds;
    return bodies <= 25 ? 5 : bodies <= 100 ? 3 : 1;
}

BenchResult against(const std::string& name, const char* peer, const std::vector<Round>& rounds,
                    double Round::*theirs) {
    BenchResult result{name, median_over(rounds, [](const Round& r) { return r.ours; }), "ms a step"};
    if (!sim_bench::bullet_is_there()) return result;
    result.peer = peer;
    result.peer_version = "Bullet " + sim_bench::bullet_version();
    result.peer_value = median_over(rounds, [&](const Round& r) { return r.*theirs; });
    result.ratio = median_over(rounds, [&](const Round& r) { return r.ours / r.*theirs; });
    return result;
}

void add_results(BenchReport& report, const std::string& prefix, const sim::WorldDefinition& definition,
                 const MachineSpeed& speed, const std::vector<Round>& rounds) {
    const int bodies = static_cast<int>(definition.bodies.size());
    const int modes = definition.bodies.front().fidelity.modes;
    report.results.push_back(
        against(prefix + "_vs_bullet_rigid", "btRigidBody convex hulls", rounds, &Round::rigid));
    report.results.push_back(against(prefix + "_vs_bullet_reduced",
                                     "btReducedDeformableBody (no contact among them)", rounds,
                                     &Round::reduced));
    const double per_body_us = 1e3 * report.results.back().value / bodies;
    const double contacts = median_over(rounds, [](const Round& r) { return r.contacts; }) / bodies;
    const LeastWork work = least_work(modes, kSamples, definition.settings.substeps, contacts);
    const double bound_us = 1e6 * std::max(work.flops / speed.flops, work.bytes / speed.bytes_per_second);
    report.results.push_back({prefix + "_per_body", per_body_us, "us a step"});
    report.results.push_back({prefix + "_contacts_per_body", contacts, "points"});
    report.results.push_back({prefix + "_bound_per_body", bound_us, "us a step"});
    report.results.push_back({prefix + "_share_of_bound", bound_us / per_body_us, "reached"});
}

void add_growth(BenchReport& report, const SimBenchOptions& options) {
    const auto cost = [&](int bodies) {
        const std::string name = fmt::format("bodies{}_modal{}_per_body", bodies, options.modes);
        const auto found = std::find_if(report.results.begin(), report.results.end(),
                                        [&](const BenchResult& r) { return r.name == name; });
        return found->value;
    };
    const int first = options.bodies.front(), last = options.bodies.back();
    if (first == last) return;
    report.results.push_back(
        {fmt::format("per_body_at_{}_over_{}", last, first), cost(last) / cost(first), "times the cost"});
}

}  // namespace

LeastWork least_work(int modes, int samples, int substeps, double contacts_per_body) {
    const double rows = 3 * 2 * 4 * (6.0 + modes);
    return {samples * (6.0 * modes + 18) + substeps * (6.0 * modes + 100) +
                contacts_per_body * (substeps * rows + 60),
            2.0 * 4 * (samples * 3 + 2 * modes + 13)};
}

BenchReport bench_sim(const SimBenchOptions& options,
                      const std::function<void(const std::string&)>& progress) {
    BenchReport report;
    const MachineSpeed speed = measure_machine_speed();
    report.results.push_back({"core_peak_single_precision", 1e-9 * speed.flops, "Gflop/s"});
    report.results.push_back({"core_memory_read", 1e-9 * speed.bytes_per_second, "GB/s"});
    const auto measure = [&](const std::string& prefix, const sim::WorldDefinition& definition) {
        std::vector<Round> rounds;
        for (int i = 0; i < rounds_for(static_cast<int>(definition.bodies.size()), options); ++i) {
            progress(fmt::format("{}, round {}", prefix, i + 1));
            rounds.push_back(run_round(definition, options));
        }
        add_results(report, prefix, definition, speed, rounds);
    };
    if (options.scene) {
        measure(options.scene->name, options.scene->world);
    } else {
        for (const int bodies : options.bodies)
            measure(fmt::format("bodies{}_modal{}", bodies, options.modes),
                    sim_bench::falling_balls(bodies, options.modes));
        add_growth(report, options);
    }
    report.notes.push_back(
        fmt::format("{} steps of 1/60 s ({} substeps of ours), one thread, processor time, in turns of {} "
                    "steps; nothing sleeps.",
                    options.steps, sim::WorldSettings{}.substeps, kTurn));
    report.notes.push_back(std::string(options.scene
                                           ? "The scene's bodies and planes, without its constraints."
                                           : "Balls of 0.5 m, 182 vertices, 360 triangles, falling into a "
                                             "box whose floor grows with their number.") +
                           " Bound: the flops that the method cannot do without (app/bench/bench_sim.h) at "
                           "the core's peak, or its bytes from memory.");
    if (!sim_bench::bullet_is_there())
        report.notes.push_back("This build has no Bullet: no ratios. Install libbullet-dev and build again.");
    return report;
}

}  // namespace app
