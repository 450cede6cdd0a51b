#include "bench/bench_hard.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "files/assets.h"
#include "files/bad_input.h"
#include "process/clock.h"
#include "scene/scene.h"

namespace app {
namespace {

using sim_bench::RigidPeer;
using sim_bench::RigidState;

constexpr double kLeastTimed_s =
    0.02;  // of processor time; shorter runs are repeated, kMostRuns times at most
constexpr int kMostRuns = 5;
constexpr const char* kOurs = "MusicWorld";

/// Our world as a peer.
class OurRigid : public RigidPeer {
public:
    explicit OurRigid(const sim::WorldDefinition& definition) : world_(definition) {}
    void step() override { world_.step(); }
    [[nodiscard]] std::vector<RigidState> states() override { return rigid_states(world_); }
    [[nodiscard]] const sim::World& world() const { return world_; }

private:
    sim::World world_;
};

/// An engine in one setting.
struct Entry {
    std::string engine, version, settings;
    std::function<std::unique_ptr<RigidPeer>(double dt)> make;
};

sim::WorldDefinition at_step(sim::WorldDefinition world, double dt, bool sleeping) {
    world.settings.dt = dt, world.settings.sleeping = sleeping;
    return world;
}

/// Ours as the scene says, then with the other choice of sleeping.
void add_ours(std::vector<Entry>& entries, const sim::WorldDefinition& world) {
    const auto add = [&](bool sleeping) {
        entries.push_back(
            {kOurs, MUSICWORLD_VERSION,
             fmt::format("{} substeps, sleeping {}", world.settings.substeps, sleeping ? "on" : "off"),
             [&world, sleeping](double dt) {
                 return std::make_unique<OurRigid>(at_step(world, dt, sleeping));
             }});
    };
    add(world.settings.sleeping);
    if (world.settings.sleeping) add(false);
}

/// A library's settings that can make a difference in this scene.
void add_peer(std::vector<Entry>& entries, const sim::WorldDefinition& world,
              const sim_bench::PeerLibrary& peer) {
    const auto add = [&](bool hulls, bool sleeping, const std::string& method) {
        const sim_bench::PeerSettings settings{0, sleeping, hulls, method};
        std::string words = hulls ? "hulls" : "spheres and boxes";
        if (peer.sleeps) words += fmt::format(", sleeping {}", sleeping ? "on" : "off");
        words += ", " + method;
        entries.push_back({peer.name, peer.version, words, [&world, make = peer.make, settings](double dt) {
                               sim_bench::PeerSettings at = settings;
                               at.dt = dt;
                               return make(world, at);
                           }});
    };
    const bool sleeps = peer.sleeps && world.settings.sleeping, contacts = world.constraints.empty();
    for (const bool hulls : {false, true})
        for (const bool sleeping : {false, true})
            if ((!hulls || contacts) && (!sleeping || sleeps)) add(hulls, sleeping, peer.methods.front());
    for (std::size_t i = 1; i < peer.methods.size(); ++i) add(false, false, peer.methods[i]);
}

/// Steps done and the processor time that they took, without the looking.
struct Watched {
    int steps = 0;
    double spent_s = 0;
};

/// Runs to the end or until the state is given up.
Watched watch(RigidPeer& world, HardWatch& judge, double dt, int steps) {
    const auto* ours = dynamic_cast<const OurRigid*>(&world);
    Watched done;
    while (done.steps < steps) {
        const double begin = thread_cpu_s();
        world.step();
        done.spent_s += thread_cpu_s() - begin;
        ++done.steps;
        const std::optional<double> energy =
            ours ? std::optional(ours->world().energy().total()) : std::nullopt;
        if (!world.whole() || !judge.look(done.steps * dt, world.states(), energy)) break;
    }
    return done;
}

/// Of a run too short for its time to be known from within.
double timed_s(const Entry& entry, double dt, int steps) {
    double spent = 0;
    int runs = 0;
    for (; runs == 0 || (spent < kLeastTimed_s && runs < kMostRuns); ++runs) {
        const std::unique_ptr<RigidPeer> world = entry.make(dt);
        const double begin = thread_cpu_s();
        for (int done = 0; done < steps; ++done) world->step();
        spent += thread_cpu_s() - begin;
    }
    return spent / runs;
}

HardRun run_once(const Scene& scene, const HardScene& hard, const Entry& entry, int halvings) {
    HardRun run{hard.name, entry.engine, entry.version, entry.settings, 0, halvings, 0, {}};
    run.dt_s = std::ldexp(scene.world.settings.dt, -halvings);
    const int steps = static_cast<int>(std::llround(scene.seconds / run.dt_s));
    HardWatch judge(scene.world, hard);
    const std::unique_ptr<RigidPeer> world = entry.make(run.dt_s);
    const Watched done = watch(*world, judge, run.dt_s, steps);
    const auto* ours = dynamic_cast<const OurRigid*>(world.get());
    const auto all = static_cast<int>(std::ranges::count(scene.world.bodies, false, &sim::WorldBody::fixed));
    run.figures = judge.figures(ours             ? static_cast<int>(ours->world().quarantined().size())
                                : world->whole() ? 0
                                                 : all);
    const double spent_s = done.spent_s > kLeastTimed_s ? done.spent_s : timed_s(entry, run.dt_s, done.steps);
    run.ms_per_s = 1e3 * spent_s / (done.steps * run.dt_s);
    return run;
}

Scene read_hard_scene(const std::string& name) {
    return read_scene(assets_folder() / "scenes" / "hard" / (name + ".toml"));
}

HardComparison compare(const HardScene& hard, const HardBenchOptions& options,
                       const std::function<void(const std::string&)>& progress) {
    const Scene scene = read_hard_scene(hard.name);
    std::vector<Entry> entries;
    add_ours(entries, scene.world);
    for (const sim_bench::PeerLibrary& peer : sim_bench::rigid_peers()) add_peer(entries, scene.world, peer);
    HardComparison made{hard, scene.seconds, {}};
    for (const Entry& entry : entries) {
        progress(fmt::format("{}: {}, {}", hard.name, entry.engine, entry.settings));
        HardEntrant entrant;
        for (int halvings = 0; halvings <= options.halvings; ++halvings) {
            entrant.runs.push_back(run_once(scene, hard, entry, halvings));
            const HardRun& last = entrant.runs.back();
            if (last.figures.right && (made.entrants.empty() || made.is_equal(last))) break;
            if (1e-3 * last.ms_per_s * scene.seconds > options.longest_s) break;
        }
        made.entrants.push_back(std::move(entrant));
    }
    return made;
}

const HardRun* cheapest(const std::vector<HardRun>& runs, const std::function<bool(const HardRun&)>& fits) {
    const HardRun* best = nullptr;
    for (const HardRun& run : runs)
        if (fits(run) && (!best || run.ms_per_s < best->ms_per_s)) best = &run;
    return best;
}

}  // namespace

double HardComparison::equal_error() const {
    const HardFigures& first = entrants.front().runs.front().figures;
    return first.right ? std::max(first.error, kLeastError) : std::numeric_limits<double>::infinity();
}

const HardRun* HardComparison::best_of(const HardEntrant& entrant) const {
    return cheapest(entrant.runs, [this](const HardRun& run) { return is_equal(run); });
}

const HardRun* HardComparison::best_of(const std::string& engine) const {
    const HardRun* best = nullptr;
    for (const HardEntrant& entrant : entrants) {
        if (entrant.runs.front().engine != engine) continue;
        const HardRun* run = best_of(entrant);
        if (run && (!best || run->ms_per_s < best->ms_per_s)) best = run;
    }
    return best;
}

std::vector<std::string> HardComparison::peers() const {
    std::vector<std::string> names;
    for (const HardEntrant& entrant : entrants)
        if (const std::string& name = entrant.runs.front().engine;
            name != ours().engine && std::ranges::find(names, name) == names.end())
            names.push_back(name);
    return names;
}

HardBench bench_hard(const HardBenchOptions& options,
                     const std::function<void(const std::string&)>& progress) {
    HardBench bench;
    for (const HardScene& scene : hard_scenes())
        if (options.scenes.empty() || std::ranges::find(options.scenes, scene.name) != options.scenes.end())
            bench.scenes.push_back(compare(scene, options, progress));
    bench.notes = {
        "Lengths are shares of the largest extent of the smallest body that moves; energies of what there "
        "is: "
        "the kinetic energy of the start and what a whole fall frees. Through: bodies whose centre crossed "
        "the "
        "inner half of another one or went beneath a plane. Thrown: bodies that end farther than their size "
        "from "
        "where they belong, or were faster than all the energy could make them.",
        fmt::format(
            "At equal error: the cheapest run that is right and errs no more than ours at the scene's step "
            "(or {:g}), the step halved up to {} times, but not after a run of {:g} s; where ours is not "
            "right at "
            "that step, the cheapest right runs. Processor time of the steps alone, one thread.",
            kLeastError, options.halvings, options.longest_s),
        "Peers have rigid bodies, also for a body with modes, and joints without a spring."};
    for (const sim_bench::PeerLibrary& peer : sim_bench::rigid_peers())
        bench.notes.push_back(fmt::format("{} {}: {}.", peer.name, peer.version, peer.settings));
    for (const char* name : {"Bullet", "MuJoCo"})
        if (std::ranges::none_of(sim_bench::rigid_peers(),
                                 [&](const sim_bench::PeerLibrary& p) { return p.name == name; }))
            bench.notes.push_back(fmt::format("This build has no {0}: install lib{1}-dev and build again.",
                                              name, name == std::string("Bullet") ? "bullet" : "mujoco"));
    return bench;
}

}  // namespace app
