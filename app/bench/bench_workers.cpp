#include "bench/bench_workers.h"

#include <falling_bodies.h>
#include <fmt/format.h>
#include <update_throughput.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numeric>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "report/plot.h"
#include "report/table.h"
#include "scene/scene.h"

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

using Progress = std::function<void(const std::string&)>;
using Factor = std::function<double(int, std::uint64_t)>;

constexpr int kModes = 12;

/// The bundled benchmark of so many bodies, or as many balls in a box. Nothing sleeps: every step is work.
sim::WorldScene scene_of(int bodies) {
    sim::WorldScene scene;
    const std::filesystem::path file = find_scene(fmt::format("benchmark{}", bodies));
    if (std::filesystem::is_regular_file(file))
        scene = static_cast<const sim::WorldScene&>(read_scene(file));
    else
        scene.world = sim_bench::falling_balls(bodies, kModes);
    scene.world.settings.sleeping = false;
    return scene;
}

/// A number in [0, 1) for a worker's step, the same in every run.
double drawn(std::uint64_t a, std::uint64_t b) {
    std::uint64_t x = a * 0x9e3779b97f4a7c15u + b * 0xbf58476d1ce4e5b9u + 1992;  // splitmix64
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return static_cast<double>((x ^ (x >> 31)) >> 11) * 0x1p-53;
}

/// Every step of every worker twice as long with probability 0.2.
double unsteady(int worker, std::uint64_t step) {
    return drawn(std::uint64_t(worker), step) < 0.2 ? 2 : 1;
}

sim::DistributedSettings settings_of(int steps, int bound, bool balance) {
    sim::DistributedSettings settings;
    settings.pace = bound > 0 ? sim::Pace::bounded : sim::Pace::lockstep;
    settings.bound = bound;
    settings.steps = std::uint64_t(steps);
    settings.market.trade = balance;
    return settings;
}

double apart(const std::vector<Eigen::Vector3d>& a, const std::vector<Eigen::Vector3d>& b) {
    double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]).squaredNorm();
    return a.empty() ? 0 : std::sqrt(sum / static_cast<double>(a.size()));
}

class WorkersBenchRun {
public:
    WorkersBenchRun(const WorkersBenchOptions& options, const Progress& progress)
        : options_(options),
          progress_(progress),
          most_workers_(std::ranges::max(options.workers)),
          most_bodies_(std::ranges::max(options.bodies)) {}

    void speed_ups() {
        for (const int bodies : options_.bodies) speed_up(bodies);
    }

    /// Lockstep solves a pile that crosses workers at each of them; a barrier's cost alone is that of the
    /// asynchronous run's own steps with one (`with_barrier_s`).
    void stragglers() {
        const int workers = most_workers_;
        const sim::WorldScene scene = scene_of(most_bodies_);
        const Factor permanent = [](int worker, std::uint64_t) { return worker == 0 ? 2.0 : 1.0; };
        const Factor wandering = [workers](int worker, std::uint64_t step) {
            return worker == static_cast<int>(drawn(step / 20, 7) * workers) ? 2.0 : 1.0;
        };
        const auto compare = [&](const std::string& name, const Factor& factor, int bound) {
            progress_("stragglers: " + name);
            const MeasuredRun lockstep = measure(scene, workers, {0, false, factor}),
                              async = measure(scene, workers, {bound, false, factor});
            add(name + "_lockstep_elapsed", lockstep.result.elapsed_s, "s");
            add(name + "_async_elapsed", async.result.elapsed_s, "s");
            add(name + "_async_over_lockstep", lockstep.result.elapsed_s / async.result.elapsed_s,
                "times as fast");
            add(name + "_async_over_barrier", async.with_barrier_s() / async.result.elapsed_s,
                "times as fast");
            return std::pair{lockstep.result.elapsed_s, async.with_barrier_s()};
        };
        const auto [lockstep, barrier] = compare("straggler_permanent_unbalanced", permanent, options_.bound);
        progress_("stragglers: permanent, balanced");
        const double balanced = measure(scene, workers, {options_.bound, true, permanent}).result.elapsed_s,
                     balanced_lockstep = measure(scene, workers, {0, true, permanent}).result.elapsed_s;
        const std::string async_name = "straggler_permanent_async_balanced_",
                          lockstep_name = "straggler_permanent_lockstep_balanced_";
        add(async_name + "elapsed", balanced, "s");
        add(lockstep_name + "elapsed", balanced_lockstep, "s");
        add(async_name + "over_lockstep", lockstep / balanced, "times as fast");
        add(async_name + "over_barrier", barrier / balanced, "times as fast");
        add(lockstep_name + "over_lockstep", lockstep / balanced_lockstep, "times as fast");
        compare("straggler_unsteady_b4", unsteady, 4);
        compare("straggler_wandering_b16", wandering, 16);
        bench_.report.notes.push_back(
            "A permanent straggler without balancing gains nothing by asynchrony: once the others are B "
            "steps "
            "ahead they wait for it at every step, so all go at its pace. Only less work helps it: "
            "balancing.");
    }

    void bounds() {
        const int workers = most_workers_;
        const sim::WorldScene scene = scene_of(most_bodies_);
        MeasuredRun lockstep;
        for (const int bound : {0, 1, 2, 4, 8, 16, 32}) {
            progress_(fmt::format("bound {}", bound));
            MeasuredRun run = measure(scene, workers, {bound, false});
            if (bound == 0) lockstep = run;
            const MeasuredRun slow = measure(scene, workers, {bound, false, unsteady});
            bench_.bounds.push_back({bound, run.result.elapsed_s, slow.result.elapsed_s, run.momentum_drift,
                                     apart(run.after_a_second, lockstep.after_a_second),
                                     run.mean_height / lockstep.mean_height, run.result.largest_ghost_age});
            const BoundRow& row = bench_.bounds.back();
            const std::string name = fmt::format("bound{}", bound);
            add(name + "_elapsed", row.elapsed_s, "s");
            add(name + "_unsteady_elapsed", row.elapsed_unsteady_s, "s");
            add(name + "_momentum_drift", row.momentum_drift, "of sum |m v|");
            add(name + "_apart_after_a_second", row.apart_m, "m rms");
            add(name + "_height_at_end", row.height, "times lockstep's");
        }
    }

    void migration() {
        progress_("migration");
        const Scene scene = read_scene(find_scene("migration30"));
        sim::DistributedSettings settings = settings_of(500, options_.bound, true);
        settings.all_to_first = scene.workers.all_to_first;
        settings.market.from_step = scene.workers.balance_from;
        sim::SimulatedProcessors processors = options_.processors;
        processors.count = 3;
        const MeasuredRun run = measure_run(scene, settings, processors);
        const std::uint64_t from = scene.workers.balance_from, load = scene.events.at(0).step;
        add("migration_unevenness_10_steps_after_start", unevenness_at(run, from + 10), "allowed: 1");
        add("migration_unevenness_10_steps_after_load", unevenness_at(run, load + 10), "allowed: 1");
        add("migration_most_trades_in_20_steps_before_load", most_trades(run, from + 10, load, 20), "trades");
        add("migration_most_trades_in_20_steps_after_load", most_trades(run, load + 10, settings.steps, 20),
            "trades");
        add("migration_bodies_traded", double(run.result.migrations), "bodies");
        bench_.migration = run.history;
    }

    /// Real processes, as many as there are cores for them beside the application.
    void processes() {
        const sim::WorldScene scene = scene_of(most_bodies_);
        const int cores = static_cast<int>(std::thread::hardware_concurrency());
        double alone = 0;
        for (const int workers : options_.workers) {
            if (workers > std::max(1, cores)) continue;
            progress_(fmt::format("{} worker processes", workers));
            sim::DistributedLaunch launch;
            launch.processes = {options_.program, {"worker"}, workers};
            for (const int bound : {0, options_.bound}) {
                const double elapsed =
                    measure_run(scene, settings_of(options_.steps, bound, true), launch).result.elapsed_s;
                if (alone == 0) alone = elapsed;
                const std::string name = fmt::format("processes_bodies{}_workers{}_{}", most_bodies_, workers,
                                                     bound > 0 ? "async" : "lockstep");
                add(name + "_elapsed", elapsed, "s");
                add(name + "_speed_up", alone / elapsed, "times one");
            }
        }
        bench_.report.notes.push_back(
            fmt::format("processes: real ones by the wall clock, at most {}, this machine's cores.", cores));
    }

    /// Messages of all bodies, as many as pass in two seconds.
    void throughput() {
        struct Route {
            const char* name;
            bool keys, through_application;
        };
        for (const Route& route : {Route{"curve_one_hop", true, false},
                                   {"curve_through_application", true, true},
                                   {"plain_through_application", false, true}}) {
            progress_(fmt::format("throughput: {}", route.name));
            sim_bench::ThroughputSettings settings;
            settings.bodies = most_bodies_;
            settings.keys = route.keys, settings.through_application = route.through_application;
            const sim_bench::Throughput t = sim_bench::measure_update_throughput(settings);
            const std::string name = fmt::format("tcp_{}", route.name);
            add(name + "_updates", 1e-6 * t.updates_per_s, "million bodies a second");
            add(name + "_cpu", t.cpu_ns_per_update, "ns a body, all threads");
            if (!route.keys) continue;
            add(name + "_bytes_per_update", t.bytes_per_update, "bytes");
            add(name + "_encode", t.encode_ns, "ns a body");
            add(name + "_decode", t.decode_ns, "ns a body");
        }
        bench_.report.notes.push_back(
            fmt::format("throughput: quantised states of {} modes over tcp on this machine, {} bodies a "
                        "message, encoded by "
                        "one thread, checked and decoded by another; CURVE encrypts and authenticates.",
                        kModes, most_bodies_));
    }

    void note_clock() {
        const sim::SimulatedProcessors& p = options_.processors;
        bench_.report.notes.push_back(fmt::format(
            "Clock: simulated processors; costs {}, {} times slower than here; {:g} s from worker to worker; "
            "events in simulated order in one thread. {} steps, async at most {} ahead. Ceiling: as many "
            "worlds "
            "as workers, each with its part of the bodies between walls, no messages.",
            p.modelled ? "counted, not measured" : "this thread's processor time", p.slowdown, p.latency_s,
            options_.steps, options_.bound));
    }

    [[nodiscard]] WorkersBench result() { return std::move(bench_); }

private:
    struct Way {
        int bound = 0;  ///< 0: lockstep
        bool balance = false;
        Factor factor = {};
    };
    MeasuredRun measure(const sim::WorldScene& scene, int workers, const Way& way) {
        sim::SimulatedProcessors processors = options_.processors;
        processors.count = workers;
        processors.factor = way.factor;
        return measure_run(scene, settings_of(options_.steps, way.bound, way.balance), processors);
    }

    /// The longest of as many worlds as there are workers, each with its part of the bodies and no others.
    double ceiling(const sim::WorldScene& scene, int workers) {
        double longest = 0;
        for (int k = 0; k < workers; ++k) {
            sim::WorldScene strip;
            strip.world = strip_of(scene.world, k, workers);
            longest = std::max(longest, measure(strip, 1, {}).result.elapsed_s);
        }
        return longest;
    }

    void speed_up(int bodies) {
        const sim::WorldScene scene = scene_of(bodies);
        SpeedUp speed_up;
        speed_up.bodies = bodies;
        speed_up.alone_s = measure(scene, 1, {}).result.elapsed_s;
        for (const int workers : options_.workers) {
            progress_(fmt::format("speed-up: {} bodies, {} workers", bodies, workers));
            SpeedUp::Row row{workers, speed_up.alone_s, speed_up.alone_s, speed_up.alone_s, 0};
            if (workers > 1) {
                const MeasuredRun async = measure(scene, workers, {options_.bound, true});
                row.async_s = async.result.elapsed_s;
                row.bytes = double(async.result.bytes) / double(std::max<std::uint64_t>(1, async.body_steps));
                row.lockstep_s = measure(scene, workers, {0, true}).result.elapsed_s;
                row.ceiling_s = ceiling(scene, workers);
            }
            speed_up.rows.push_back(row);
            const std::string name = fmt::format("bodies{}_workers{}_", bodies, workers);
            add(name + "async_elapsed", row.async_s, "s");
            add(name + "async_speed_up", speed_up.alone_s / row.async_s, "times one");
            add(name + "lockstep_speed_up", speed_up.alone_s / row.lockstep_s, "times one");
            add(name + "ceiling_speed_up", speed_up.alone_s / row.ceiling_s, "times one");
            add(name + "async_of_ceiling", row.ceiling_s / row.async_s, "share");
            add(name + "bytes_per_body_step", row.bytes, "bytes");
        }
        bench_.speed_ups.push_back(speed_up);
    }
    void add(const std::string& name, double value, const std::string& unit) {
        bench_.report.results.push_back({name, value, unit});
    }

    const WorkersBenchOptions& options_;
    const Progress& progress_;
    int most_workers_, most_bodies_;
    WorkersBench bench_;
};

const std::vector<std::pair<std::string, void (WorkersBenchRun::*)()>> kParts = {
    {"speedup", &WorkersBenchRun::speed_ups},   {"stragglers", &WorkersBenchRun::stragglers},
    {"bound", &WorkersBenchRun::bounds},        {"migration", &WorkersBenchRun::migration},
    {"processes", &WorkersBenchRun::processes}, {"throughput", &WorkersBenchRun::throughput}};

constexpr int kWidth = 960, kHeight = 380;

/// `of` takes elapsed seconds to what the panel shows.
template <typename Shown>
std::string panel(const SpeedUp& s, const Shown& of) {
    PlotPanel panel;
    const auto add = [&](const char* colour, const char* title, int dash, const auto& elapsed_s) {
        std::string points;  // lines "workers value"
        for (const SpeedUp::Row& row : s.rows)
            fmt::format_to(std::back_inserter(points), "{} {:.6g}\n", row.workers, of(elapsed_s(row)));
        panel.add(points, fmt::format("with linespoints pt 7 ps 0.5 lw 1.6 dt {} lc rgb '{}' title '{}'",
                                      dash, colour, title));
    };
    add("#8c8c8c", "ideal", 1, [&](const SpeedUp::Row& row) { return s.alone_s / row.workers; });
    add("#2b9a48", "ceiling", 3, [](const SpeedUp::Row& row) { return row.ceiling_s; });
    add("#2468b4", "asynchronous", 1, [](const SpeedUp::Row& row) { return row.async_s; });
    add("#e03131", "lockstep", 2, [](const SpeedUp::Row& row) { return row.lockstep_s; });
    return panel.text();
}

PlotScript speed_up_plot(const SpeedUp& s) {
    std::string commands =
        plot_axes() + "set multiplot layout 1,2\nset key right top\nset xlabel 'workers'\nset xrange [0:]\n";
    commands += fmt::format("set yrange [0:]\nset ylabel 'elapsed [s], {} bodies'\n", s.bodies) +
                panel(s, [](double elapsed) { return elapsed; });
    commands += "set key left top\nset ylabel 'speed-up [times]'\n" +
                panel(s, [&](double elapsed) { return s.alone_s / elapsed; });
    return {kWidth, kHeight, commands + "unset multiplot\n"};
}

Table table_of(std::span<const SpeedUp> speed_ups) {
    Table table;
    for (const SpeedUp& s : speed_ups)
        for (const SpeedUp::Row& r : s.rows)
            table.add_figures({{"bodies:d", s.bodies},
                               {"workers:d", r.workers},
                               {"ideal_s:.3g", s.alone_s / r.workers},
                               {"ceiling_s:.3g", r.ceiling_s},
                               {"async_s:.3g", r.async_s},
                               {"lockstep_s:.3g", r.lockstep_s},
                               {"bytes_per_body_step:.0f", r.bytes},
                               {"async_speed_up:.2f", s.alone_s / r.async_s, false},
                               {"ceiling_speed_up:.2f", s.alone_s / r.ceiling_s, false},
                               {"lockstep_speed_up:.2f", s.alone_s / r.lockstep_s, false},
                               {"async_of_ceiling:.2f", r.ceiling_s / r.async_s, false}});
    return table;
}

Table table_of(const std::vector<BoundRow>& rows) {
    Table table = Table::of({"bound:d", "elapsed_s:.3g", "elapsed_unsteady_s:.3g", "momentum_drift:.2g",
                             "apart_m:.2g", "height:.4f", "ghost_age:d"});
    for (const BoundRow& r : rows)
        table.add(
            {r.bound, r.elapsed_s, r.elapsed_unsteady_s, r.momentum_drift, r.apart_m, r.height, r.ghost_age});
    return table;
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

WorkersBench bench_workers(const WorkersBenchOptions& options, const Progress& progress) {
    WorkersBenchRun run(options, progress);
    for (const auto& [name, measure] : kParts)
        if (options.only.empty() || options.only.contains(name)) (run.*measure)();
    run.note_clock();
    return run.result();
}

Figures figures_of(const WorkersBench& bench) {
    Figures figures = figures_of(bench.report);
    std::string text;
    for (const SpeedUp& s : bench.speed_ups) {
        text += fmt::format("{} bodies: {:.3g} s on one processor\n{}\n", s.bodies, s.alone_s,
                            table_of(std::span(&s, 1))
                                .part({"workers", "async_speed_up", "ceiling_speed_up", "lockstep_speed_up",
                                       "async_of_ceiling", "bytes_per_body_step"})
                                .text());
        figures.plots[fmt::format("speed_up/bodies{}.svg", s.bodies)] = speed_up_plot(s);
    }
    if (!bench.speed_ups.empty()) figures.tables["speed_up.csv"] = table_of(bench.speed_ups).csv();
    if (!bench.bounds.empty()) figures.tables["bound.csv"] = table_of(bench.bounds).csv();
    if (!bench.migration.workers().empty()) figures.plots["migration.svg"] = workers_plot(bench.migration);
    text += table_of(bench.bounds).text();
    figures.text.insert(0, text.empty() ? text : text + '\n');
    return figures;
}

}  // namespace app
