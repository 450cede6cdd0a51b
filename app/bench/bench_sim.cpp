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

#include "bench/rest_overlap.h"
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
constexpr int kMostBeside = 400;  // more take peers many minutes and MuJoCo gigabytes

/// Milliseconds a step of one round.
struct Round {
    double ours = 0, rigid = 0, reduced = 0;
    std::vector<double> equal;  ///< of the peers at equal overlap, in order
    double contacts = 0;        ///< of ours, mean over the steps
};

template <typename World>
double timed_ms(World& world, int steps) {
    const double begin = thread_cpu_s();
    for (int i = 0; i < steps; ++i) world.step();
    return 1e3 * (thread_cpu_s() - begin);
}

Round run_round(const sim::WorldDefinition& definition, const std::vector<EqualPeer>& peers, bool bullet,
                const SimBenchOptions& options) {
    sim::World ours(definition);
    std::unique_ptr<sim_bench::BulletWorld> rigid, reduced;
    if (bullet) rigid = std::make_unique<sim_bench::BulletWorld>(definition, sim_bench::BulletKind::rigid);
    if (bullet && definition.bodies.front().fidelity.modes > 0)
        reduced = std::make_unique<sim_bench::BulletWorld>(definition, sim_bench::BulletKind::reduced);
    std::vector<std::unique_ptr<sim_bench::RigidPeer>> equal;
    for (const EqualPeer& peer : peers) equal.push_back(peer.start(definition));
    Round sum;
    sum.equal.resize(equal.size());
    for (int done = 0; done < options.steps; done += kTurn) {
        const int steps = std::min(kTurn, options.steps - done);
        sum.ours += timed_ms(ours, steps);
        sum.contacts += ours.counts().contacts * static_cast<double>(steps);
        if (rigid) sum.rigid += timed_ms(*rigid, steps);
        if (reduced) sum.reduced += timed_ms(*reduced, steps);
        for (std::size_t i = 0; i < equal.size(); ++i) sum.equal[i] += timed_ms(*equal[i], steps);
    }
    for (double* ms : {&sum.ours, &sum.rigid, &sum.reduced, &sum.contacts}) *ms /= options.steps;
    for (double& ms : sum.equal) ms /= options.steps;
    return sum;
}

/// Of our balls, over the end of a run.
double overlap_at_rest(const sim::WorldDefinition& definition, int steps) {
    sim::World world(definition);
    const int rest = std::min(kRestSteps, steps);
    double sum = 0;
    for (int done = 0; done < steps; ++done) {
        world.step();
        if (done >= steps - rest) sum += mean_overlap(definition, world);
    }
    return sum / rest;
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

/// Beside a peer, by what each took in every round.
BenchResult against(const std::string& name, const std::string& peer, const std::string& version,
                    const std::vector<Round>& rounds, const std::function<double(const Round&)>& theirs) {
    BenchResult result{name, median_over(rounds, [](const Round& r) { return r.ours; }), "ms a step"};
    result.peer = peer, result.peer_version = version;
    result.peer_value = median_over(rounds, theirs);
    result.ratio = median_over(rounds, [&](const Round& r) { return r.ours / theirs(r); });
    return result;
}

void add_results(BenchReport& report, const std::string& prefix, const sim::WorldDefinition& definition,
                 const MachineSpeed& speed, const std::vector<Round>& rounds) {
    const int bodies = static_cast<int>(definition.bodies.size());
    const int modes = definition.bodies.front().fidelity.modes;
    const std::string version = "Bullet " + sim_bench::bullet_version();
    if (rounds.front().rigid > 0)
        report.results.push_back(against(prefix + "_vs_bullet_rigid", "btRigidBody convex hulls", version,
                                         rounds, [](const Round& r) { return r.rigid; }));
    if (rounds.front().reduced > 0)
        report.results.push_back(against(prefix + "_vs_bullet_reduced",
                                         "btReducedDeformableBody (no contact among them)", version, rounds,
                                         [](const Round& r) { return r.reduced; }));
    const double step_ms = median_over(rounds, [](const Round& r) { return r.ours; });
    const double per_body_us = 1e3 * step_ms / bodies;
    const double contacts = median_over(rounds, [](const Round& r) { return r.contacts; }) / bodies;
    const LeastWork work = least_work(modes, kSamples, definition.settings.substeps, contacts);
    const double bound_us = 1e6 * std::max(work.flops / speed.flops, work.bytes / speed.bytes_per_second);
    report.results.push_back({prefix + "_per_body", per_body_us, "us a step"});
    report.results.push_back({prefix + "_contacts_per_body", contacts, "points"});
    report.results.push_back({prefix + "_bound_per_body", bound_us, "us a step"});
    report.results.push_back({prefix + "_share_of_bound", bound_us / per_body_us, "reached"});
}

/// Peers whose balls overlap at rest no more than ours; what they overlap goes into the report.
std::vector<EqualPeer> equal_peers(BenchReport& report, const std::string& prefix,
                                   const sim::WorldDefinition& definition, const SimBenchOptions& options,
                                   const std::function<void(const std::string&)>& progress) {
    progress(prefix + ", overlaps at rest");
    const double ours = overlap_at_rest(definition, options.steps);
    report.results.push_back({prefix + "_overlap_at_rest", 100 * ours, "% of the diameter"});
    std::vector<EqualPeer> peers;
    for (const sim_bench::PeerLibrary& library : sim_bench::rigid_peers()) {
        progress(fmt::format("{}, overlaps of {}", prefix, library.name));
        if (std::optional<EqualPeer> equal = cheapest_equal(library, definition, options.steps, ours)) {
            report.notes.push_back(fmt::format("{}: {} {} at equal overlap: {}; it overlaps by {:.2g} %.",
                                               prefix, library.name, library.version, equal->words(),
                                               100 * equal->overlap));
            peers.push_back(std::move(*equal));
        } else {
            report.notes.push_back(
                fmt::format("{}: no setting of {} {} overlaps as little as ours down to a sixteenth of the "
                            "step, or within half a minute of processor time.",
                            prefix, library.name, library.version));
        }
    }
    return peers;
}

/// What a body costs among more, against the first number.
void add_growth(BenchReport& report, const SimBenchOptions& options) {
    const auto cost = [&](int bodies) {
        const std::string name = fmt::format("bodies{}_modal{}_per_body", bodies, options.modes);
        return std::ranges::find(report.results, name, &BenchResult::name)->value;
    };
    const int first = options.bodies.front();
    for (const int bodies : options.bodies)
        if (bodies != first)
            report.results.push_back({fmt::format("per_body_at_{}_over_{}", bodies, first),
                                      cost(bodies) / cost(first), "times the cost"});
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
        const int bodies = static_cast<int>(definition.bodies.size());
        const bool beside = bodies <= kMostBeside;
        std::vector<EqualPeer> peers;
        if (beside) peers = equal_peers(report, prefix, definition, options, progress);
        std::vector<Round> rounds;
        for (int i = 0; i < rounds_for(bodies, options); ++i) {
            progress(fmt::format("{}, round {}", prefix, i + 1));
            rounds.push_back(run_round(definition, peers, beside && sim_bench::bullet_is_there(), options));
        }
        for (std::size_t i = 0; i < peers.size(); ++i) {
            const sim_bench::PeerLibrary& library = peers[i].peer;
            report.results.push_back(
                against(fmt::format("{}_vs_{}_at_equal_overlap", prefix, lower(library.name)),
                        library.name + " " + peers[i].words(), library.name + " " + library.version, rounds,
                        [i](const Round& r) { return r.equal[i]; }));
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
    report.notes.push_back(
        fmt::format("Equal overlap: the mean depth of all pairs that overlap, along the line of centres, "
                    "over the last {} steps; "
                    "ours where the modes have moved the surfaces. Of each peer the cheapest of its methods "
                    "and steps, halved from "
                    "1/60 s, that overlaps no more; its balls are rigid spheres. Among more than {} balls "
                    "ours are alone.",
                    kRestSteps, kMostBeside));
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
