#include "bench/bench_workers.h"

#include <falling_bodies.h>
#include <fmt/format.h>
#include <shared_run.h>
#include <thread_speed.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <thread>
#include <utility>

#include "files/assets.h"
#include "report/plot.h"
#include "report/table.h"
#include "scene/scene.h"
#include "statistics/statistics.h"

namespace app {
namespace {

/// Of a whole run.
class MomentumObserver : public sim::DistributedObserver {
public:
    MomentumObserver(const sim::WorldScene& scene, std::uint64_t steps) : scene_(scene), last_(steps) {}

    void at(std::uint64_t step, const sim::World& world) override {
        if (step == 0) momentum_.emplace(scene_, world, true);
        if (step % 10 == 0 || step == last_) momentum_->look(world);
    }
    /// `outside`: the impulse of what is no body.
    [[nodiscard]] double drift(const Eigen::Vector3d& outside) const {
        return momentum_->drift(outside).value().share();
    }

private:
    const sim::WorldScene& scene_;
    std::uint64_t last_;
    std::optional<MomentumWatch> momentum_;
};

using sim_bench::SharedRun;
using Progress = std::function<void(const std::string&)>;
using Factor = std::function<double(int, std::uint64_t)>;

constexpr int kModes = 12;

/// The bundled benchmark of so many bodies, or as many balls in a box. Nothing sleeps: every step is work.
sim::WorldScene scene_of(int bodies) {
    sim::WorldScene scene;
    const std::string name = fmt::format("benchmark{}", bodies);
    const std::vector<std::string> bundled = bundled_names("scenes");
    if (std::ranges::find(bundled, name) != bundled.end())
        scene = static_cast<const sim::WorldScene&>(read_scene(find_scene(name)));
    else
        scene.world = sim_bench::falling_balls(bodies, kModes);
    scene.world.settings.sleeping = false;
    return scene;
}

sim::DistributedSettings settings_of(int steps, int bound, bool balance) {
    sim::DistributedSettings settings;
    settings.bound = bound;
    settings.steps = std::uint64_t(steps);
    settings.market.trade = balance;
    return settings;
}

class WorkersBenchRun {
public:
    WorkersBenchRun(const WorkersBenchOptions& options, const Progress& progress)
        : options_(options),
          progress_(progress),
          most_workers_(std::ranges::max(options.workers)),
          most_bodies_(std::ranges::max(bodies_or({25, 400}))) {}

    void speed_ups() {
        for (const int bodies : bodies_or({25, 400})) speed_up(bodies);
        if (!options_.processors.modelled)
            note(
                "speedup: workers that take turns in one thread find their caches cold. So each did its "
                "work once more without the others; cold_caches: how many times as long it took in turns, "
                "which the elapsed times and speed-ups leave out (the other parts do not). "
                "busiest_speed_up: if nobody waited, as by the work of the worker that had most, alone; "
                "other load makes steps uneven, so that workers wait.");
    }

    void stragglers() {
        const int workers = most_workers_;
        const sim::WorldScene scene = scene_of(most_bodies_);
        const Factor permanent = [](int worker, std::uint64_t) { return worker == 0 ? 2.0 : 1.0; };
        const Factor wandering = [workers](int worker, std::uint64_t step) {
            return sim_bench::wandering(workers, worker, step);
        };
        const auto elapsed = [&](const Way& way) { return measure(scene, workers, way).result.elapsed_s; };
        const auto compare = [&](const std::string& name, const Factor& factor, int bound) {
            progress_("stragglers: " + name);
            const double barrier = elapsed({0, false, factor}), bounded = elapsed({bound, false, factor});
            add(name + "_barrier_elapsed", barrier, "s");
            add(name + "_bounded_elapsed", bounded, "s");
            add(name + "_bounded_over_barrier", barrier / bounded, "times as fast");
            return barrier;
        };
        const double barrier = compare("straggler_permanent_unbalanced", permanent, options_.bound);
        progress_("stragglers: permanent, balanced");
        const double balanced = elapsed({options_.bound, true, permanent}),
                     balanced_barrier = elapsed({0, true, permanent});
        const std::string bounded_name = "straggler_permanent_bounded_balanced_",
                          barrier_name = "straggler_permanent_barrier_balanced_";
        add(bounded_name + "elapsed", balanced, "s");
        add(barrier_name + "elapsed", balanced_barrier, "s");
        add(bounded_name + "over_barrier", barrier / balanced, "times as fast");
        add(barrier_name + "over_barrier", barrier / balanced_barrier, "times as fast");
        std::vector<double> gains{barrier / balanced};
        for (int slow = 1; slow < workers; ++slow) {  // what they have at first differs
            progress_(fmt::format("stragglers: permanent, worker {}", slow));
            const Factor half = [slow](int worker, std::uint64_t) { return worker == slow ? 2.0 : 1.0; };
            gains.push_back(elapsed({0, false, half}) / elapsed({options_.bound, true, half}));
        }
        std::ranges::sort(gains);
        const std::string each_name = "straggler_permanent_each_bounded_balanced_over_barrier_";
        add(each_name + "median", quantile(gains, 0.5), "times as fast");
        add(each_name + "least", gains.front(), "times as fast");
        add(each_name + "most", gains.back(), "times as fast");
        (void)compare("straggler_unsteady_b4", sim_bench::unsteady, 4);
        (void)compare("straggler_wandering_b16", wandering, 16);
        note(
            "A permanent straggler without balancing gains nothing by asynchrony: once the others are B "
            "steps ahead they wait for it at every step, so all go at its pace. Only less work helps it: "
            "balancing.");
    }

    void bounds() {
        const int workers = most_workers_;
        const sim::WorldScene scene = scene_of(most_bodies_);
        const SharedRun alone = sim_bench::measure_alone(scene, settings_of(options_.steps, 0, false));
        for (const int bound : {0, 1, 2, 4, 8, 16, 32}) {
            progress_(fmt::format("bound {}", bound));
            MomentumObserver momentum(scene, std::uint64_t(options_.steps));
            SharedRun run = measure(scene, workers, {bound, false}, &momentum);
            const SharedRun slow = measure(scene, workers, {bound, false, sim_bench::unsteady});
            bench_.bounds.push_back({bound, run.result.elapsed_s, slow.result.elapsed_s,
                                     momentum.drift(run.result.outside_impulse), sim_bench::apart(run, alone),
                                     run.mean_height / alone.mean_height, run.result.largest_ghost_age});
            const BoundRow& row = bench_.bounds.back();
            const std::string name = fmt::format("bound{}", bound);
            add(name + "_elapsed", row.elapsed_s, "s");
            add(name + "_unsteady_elapsed", row.elapsed_unsteady_s, "s");
            add(name + "_momentum_drift", row.momentum_drift, "of sum |m v|");
            add(name + "_apart_after_a_second", row.apart_m, "m rms");
            add(name + "_height_at_end", row.height, "times one process's");
        }
    }

    void migration() {
        progress_("migration");
        const Scene scene = read_scene(find_scene("migration30"));
        sim::DistributedSettings settings = settings_of(500, options_.bound, true);
        settings.all_to_first = scene.workers.all_to_first;
        settings.market.from_step = scene.workers.balance_from;
        sim_bench::SimulatedProcessors processors = options_.processors;
        processors.count = 3;
        const SharedRun run = sim_bench::measure_run(scene, settings, processors);
        const std::uint64_t from = scene.workers.balance_from, load = scene.events.at(0).step;
        add("migration_unevenness_10_steps_after_start", sim_bench::unevenness_at(run, from + 10),
            "allowed: 1");
        add("migration_unevenness_10_steps_after_load", sim_bench::unevenness_at(run, load + 10),
            "allowed: 1");
        add("migration_most_trades_in_20_steps_before_load", sim_bench::most_trades(run, from + 10, load, 20),
            "trades");
        add("migration_most_trades_in_20_steps_after_load",
            sim_bench::most_trades(run, load + 10, settings.steps, 20), "trades");
        add("migration_bodies_traded", double(run.result.migrations), "bodies");
        for (const sim::WorkerStep& step : run.steps) bench_.migration.add(step);
    }

    /// This machine's cores shared by threads of one process.
    void threads() {
        std::vector<int> counts;
        for (int threads = 1; threads < cores(); threads *= 2) counts.push_back(threads);
        counts.push_back(cores());
        for (const int bodies : bodies_or({400, 1600})) {
            progress_(fmt::format("threads: {} bodies", bodies));
            const auto all =
                sim_bench::measure_threads(scene_of(bodies).world, counts, options_.steps, options_.rounds);
            for (const sim_bench::ThreadsSpeed& speed : all) {
                const std::string name = fmt::format("threads_bodies{}_threads{}", bodies, speed.threads);
                add(name + "_elapsed", speed.elapsed_s, "s");
                add(name + "_speed_up", all.front().elapsed_s / speed.elapsed_s, "times one");
                add(name + "_cpu", speed.cpu_s, "s, all threads");
            }
        }
        note(
            fmt::format("threads: {} steps, medians of {} by the wall clock, in turns of 25 steps, times one "
                        "thread; other "
                        "load on the machine makes them slower.",
                        options_.steps, options_.rounds));
    }

    /// Real processes, as many as there are cores for them.
    void processes() {
        for (const int bodies : bodies_or({400, 1600})) processes_of(bodies);
        note(fmt::format(
            "processes: {} steps, medians of {} runs in turns, times one process without workers; at most "
            "{} workers, this machine's cores, which the application shares. Critical path: by "
            "processor time of the workers' stepping threads, with their messages, if each step waited for "
            "all others' step before it (bounded: for the one before that). bounded: with the bound; "
            "barrier: "
            "with a bound of 0.",
            options_.steps, options_.rounds, cores()));
    }

    void note_clock() {
        const sim_bench::SimulatedProcessors& p = options_.processors;
        note(fmt::format(
            "Clock of speedup, stragglers, bound and migration: simulated processors; costs {}, {} times "
            "slower than here; {:g} s from worker to worker; events in simulated order in one thread. {} "
            "steps, bounded at most {} ahead.",
            p.modelled ? "counted, not measured" : "this thread's processor time", p.slowdown, p.latency_s,
            options_.steps, options_.bound));
    }

    [[nodiscard]] WorkersBench result() { return std::move(bench_); }

private:
    struct Way {
        int bound = 0;
        bool balance = false;
        Factor factor = {};
        bool warm = false;
    };
    SharedRun measure(const sim::WorldScene& scene, int workers, const Way& way,
                      sim::DistributedObserver* also = nullptr) {
        sim_bench::SimulatedProcessors processors = options_.processors;
        processors.count = workers;
        processors.factor = way.factor;
        processors.repeat_alone = way.warm && !processors.modelled;
        return sim_bench::measure_run(scene, settings_of(options_.steps, way.bound, way.balance), processors,
                                      also);
    }

    void speed_up(int bodies) {
        const sim::WorldScene scene = scene_of(bodies);
        const auto run_of = [](const SharedRun& run) {
            const sim_bench::SimulatedResult& r = run.result;
            return SpeedUp::Run{r.elapsed_s / r.cold_caches, r.cold_caches, r.busiest_s};
        };
        SpeedUp speed_up;
        speed_up.bodies = bodies;
        const SpeedUp::Run alone = run_of(measure(scene, 1, {.warm = true}));
        speed_up.alone_s = alone.elapsed_s;
        for (const int workers : options_.workers) {
            progress_(fmt::format("speed-up: {} bodies, {} workers", bodies, workers));
            SpeedUp::Row row{workers, alone, alone};
            if (workers > 1) {
                const SharedRun bounded = measure(scene, workers, {options_.bound, true, {}, true});
                row.bounded = run_of(bounded);
                row.barrier = run_of(measure(scene, workers, {0, true, {}, true}));
                row.bytes =
                    double(bounded.result.bytes) / double(std::max<std::uint64_t>(1, bounded.body_steps));
            }
            speed_up.rows.push_back(row);
            const std::string name = fmt::format("bodies{}_workers{}_", bodies, workers);
            for (const auto& [pace, run] : {std::pair("bounded", row.bounded), {"barrier", row.barrier}}) {
                add(name + pace + "_elapsed", run.elapsed_s, "s");
                add(name + pace + "_speed_up", alone.elapsed_s / run.elapsed_s, "times one");
                if (run.busiest_s > 0)
                    add(name + pace + "_busiest_speed_up", alone.elapsed_s / run.busiest_s, "times one");
                add(name + pace + "_cold_caches", run.cold_caches, "times as long");
            }
            add(name + "bytes_per_body_step", row.bytes, "bytes");
        }
        bench_.speed_ups.push_back(speed_up);
    }

    struct Times {
        double elapsed_s, critical_path_s;
    };
    /// Both, and how many times as fast as `one`.
    void add_times(const std::string& name, const Times& times, const Times& one) {
        add(name + "_elapsed", times.elapsed_s, "s");
        add(name + "_critical_path", times.critical_path_s, "s");
        add(name + "_speed_up", one.elapsed_s / times.elapsed_s, "times one");
        add(name + "_critical_path_speed_up", one.critical_path_s / times.critical_path_s, "times one");
    }

    void processes_of(int bodies) {
        const sim::WorldScene scene = scene_of(bodies);
        std::map<std::string, std::pair<std::vector<double>, std::vector<double>>> seconds;  // of each round
        std::vector<std::string> names;
        const auto take = [&](const std::string& name, const SharedRun& run, int lead) {
            auto& [elapsed, path] = seconds[name];
            if (elapsed.empty()) names.push_back(name);
            elapsed.push_back(run.result.elapsed_s);
            path.push_back(run.critical_path_s(lead));
        };
        const std::string prefix = fmt::format("processes_bodies{}_", bodies);
        for (int round = 0; round < options_.rounds; ++round) {
            progress_(fmt::format("processes: {} bodies, round {}", bodies, round + 1));
            take(prefix + "alone", sim_bench::measure_alone(scene, settings_of(options_.steps, 0, false)), 0);
            for (const int workers : options_.workers)
                for (const int bound : {0, options_.bound}) {
                    if (workers > cores()) continue;
                    sim::DistributedLaunch launch;
                    launch.processes = {options_.program, {"worker"}, workers};
                    take(fmt::format("{}workers{}_{}", prefix, workers, bound > 0 ? "bounded" : "barrier"),
                         sim_bench::measure_run(scene, settings_of(options_.steps, bound, true), launch),
                         std::min(bound, 1));
                }
        }
        const auto times_of = [&](const std::string& name) {
            const auto& [elapsed, path] = seconds.at(name);
            return Times{median(elapsed), median(path)};
        };
        for (const std::string& name : names) add_times(name, times_of(name), times_of(names.front()));
    }

    void note(const std::string& line) { bench_.report.notes.push_back(line); }
    void add(const std::string& name, double value, const std::string& unit) {
        bench_.report.results.push_back({name, value, unit});
    }
    [[nodiscard]] std::vector<int> bodies_or(const std::vector<int>& bodies) const {
        return options_.bodies.empty() ? bodies : options_.bodies;
    }
    [[nodiscard]] static int cores() {
        return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    }

    const WorkersBenchOptions& options_;
    const Progress& progress_;
    int most_workers_, most_bodies_;
    WorkersBench bench_;
};

const std::vector<std::pair<std::string, void (WorkersBenchRun::*)()>> kParts = {
    {"speedup", &WorkersBenchRun::speed_ups}, {"stragglers", &WorkersBenchRun::stragglers},
    {"bound", &WorkersBenchRun::bounds},      {"migration", &WorkersBenchRun::migration},
    {"threads", &WorkersBenchRun::threads},   {"processes", &WorkersBenchRun::processes}};

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
    add("#2468b4", "asynchronous", 1, [](const SpeedUp::Row& row) { return row.bounded.elapsed_s; });
    add("#e03131", "barrier", 2, [](const SpeedUp::Row& row) { return row.barrier.elapsed_s; });
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
                               {"bounded_s:.3g", r.bounded.elapsed_s},
                               {"barrier_s:.3g", r.barrier.elapsed_s},
                               {"bytes_per_body_step:.0f", r.bytes},
                               {"bounded_speed_up:.2f", s.alone_s / r.bounded.elapsed_s, false},
                               {"barrier_speed_up:.2f", s.alone_s / r.barrier.elapsed_s, false},
                               {"bounded_cold_caches:.2f", r.bounded.cold_caches, false},
                               {"barrier_cold_caches:.2f", r.barrier.cold_caches, false}});
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

WorkersBench bench_workers(const WorkersBenchOptions& options, const Progress& progress) {
    WorkersBenchRun run(options, progress);
    for (const auto& [name, measure] : kParts)
        if (options.only.empty() || options.only.contains(name)) (run.*measure)();
    const auto is_chosen = [&](const char* name) { return options.only.contains(name); };
    if (options.only.empty() ||
        std::ranges::any_of(std::array{"speedup", "stragglers", "bound", "migration"}, is_chosen))
        run.note_clock();
    return run.result();
}

Figures figures_of(const WorkersBench& bench) {
    Figures figures = figures_of(bench.report);
    std::string text;
    for (const SpeedUp& s : bench.speed_ups) {
        text += fmt::format("{} bodies: {:.3g} s on one processor\n{}\n", s.bodies, s.alone_s,
                            table_of(std::span(&s, 1))
                                .part({"workers", "bounded_speed_up", "barrier_speed_up",
                                       "bounded_cold_caches", "barrier_cold_caches", "bytes_per_body_step"})
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
