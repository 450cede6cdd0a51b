#include "bench/bench_tradeoff.h"

#include <fmt/format.h>
#include <sim/accuracy.h>
#include <sim/surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>

#include "process/clock.h"
#include "report/json_document.h"
#include "report/table.h"

namespace app {
namespace {

constexpr int kMoments = 6, kMomentsPerSecond = 30;
constexpr double kSeconds = static_cast<double>(kMoments) / kMomentsPerSecond;
constexpr double kLeastMeasured_s = 0.01;  // of processor time; shorter runs are repeated

sim::WorldBody soft_body(const TradeoffSetting& setting) {
    sim::WorldBody body;
    body.shape.base.semi_axes = Eigen::Vector3d(0.4, 0.3, 0.35);
    body.material = {.young_pa = 2e5, .poisson = 0.3, .density_kg_m3 = 300};
    body.fidelity.fidelity = setting.fidelity;
    body.fidelity.modes = setting.modes;
    body.fidelity.elements = setting.elements;
    body.damping_ratio = 0.2;
    body.triangles = setting.triangles;
    body.restitution = setting.restitution;
    return body;
}

sim::WorldDefinition scene(const TradeoffSetting& setting) {
    sim::WorldDefinition world;
    world.settings.dt = 1.0 / setting.steps_per_s;
    world.settings.sleeping = false;
    world.planes.push_back({});
    for (const double height : {0.35, 0.95}) {
        sim::WorldBody body = soft_body(setting);
        body.name = height < 0.5 ? "lower" : "upper";
        body.world_from_body.translation() = Eigen::Vector3d(0.12 * (height - 0.35), height, 0);
        body.world_from_body.linear() =
            Eigen::AngleAxisd(0.3 * height, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
        body.velocity = Eigen::Vector3d(0, height < 0.5 ? 0 : -1, 0);
        world.bodies.push_back(body);
    }
    return world;
}

/// Surface points of both bodies at all moments.
using Course = Eigen::Matrix3Xd;

class Probes {
public:
    Probes() : rest_(sim::surface_mesh(soft_body({}).shape, 360).vertices) {}

    void append(const sim::World& world, Course& course, Eigen::Index& column) const {
        for (int b = 0; b < world.bodies(); ++b) {
            const sim::WorldBodyState state = world.state(b);
            for (const Eigen::Vector3d& r : rest_) {
                Eigen::Vector3d at = r;
                if (state.q.size() > 0) at += sim::mode_shapes_at(world.basis(b), r) * state.q;
                course.col(column++) = state.position + state.orientation * at;
            }
        }
    }
    [[nodiscard]] Eigen::Index columns() const {
        return 2 * kMoments * static_cast<Eigen::Index>(rest_.size());
    }

private:
    std::vector<Eigen::Vector3d> rest_;
};

struct Run {
    Course course;
    double ms_per_s = 0;
};

Run run(const TradeoffSetting& setting, const Probes& probes) {
    const sim::WorldDefinition definition = scene(setting);
    sim::World world(definition);
    Run made;
    made.course.resize(3, probes.columns());
    Eigen::Index column = 0;
    double spent = 0;
    const auto go_to_next_moment = [&](sim::World& in) {
        const double begin = thread_cpu_s();
        for (int i = 0; i < setting.steps_per_s / kMomentsPerSecond; ++i) in.step();
        spent += thread_cpu_s() - begin;
    };
    for (int moment = 0; moment < kMoments; ++moment) {
        go_to_next_moment(world);
        probes.append(world, made.course, column);
    }
    int runs = 1;
    for (; spent < kLeastMeasured_s; ++runs) {
        sim::World again(definition);
        for (int moment = 0; moment < kMoments; ++moment) go_to_next_moment(again);
    }
    made.ms_per_s = 1e3 * spent / runs / kSeconds;
    return made;
}

double error_of(const Course& course, const Course& truth) {
    const double extent = 2 * soft_body({}).shape.base.semi_axes.maxCoeff();
    return std::sqrt((course - truth).squaredNorm() / static_cast<double>(truth.cols())) / extent;
}

/// Both bodies are of one kind.
TradeoffSetting chosen(double accuracy, double& estimated) {
    TradeoffSetting setting{.fidelity = sim::Fidelity::automatic, .steps_per_s = kMomentsPerSecond};
    sim::WorldScene world;
    world.world = scene(setting);
    const sim::AccuracyReport report = sim::keep_accuracy(world, {.accuracy = accuracy, .steps = kMoments});
    const sim::WorldBody& body = world.world.bodies.front();
    setting.fidelity = body.fidelity.fidelity;
    setting.modes = body.fidelity.modes, setting.elements = body.fidelity.elements;
    setting.triangles = body.triangles;
    setting.steps_per_s *= report.step_parts;
    setting.restitution = body.restitution;
    for (const sim::BodyError& error : report.bodies) estimated = std::max(estimated, error.total());
    return setting;
}

using Json = nlohmann::ordered_json;

int modes_of(const TradeoffSetting& setting) {
    if (setting.fidelity == sim::Fidelity::rigid) return 0;
    return setting.fidelity == sim::Fidelity::linear ? 6 : setting.modes;
}

Json point_json(const TradeoffPoint& point) {
    const TradeoffSetting& s = point.setting;
    return {{"name", name_of(s)},     {"value", point.ms_per_s},  {"unit", "ms a simulated second"},
            {"peer", nullptr},        {"peer_version", nullptr},  {"ratio", nullptr},
            {"error", point.error},   {"modes", modes_of(s)},     {"step_s", 1.0 / s.steps_per_s},
            {"elements", s.elements}, {"triangles", s.triangles}, {"pareto", point.pareto}};
}

std::vector<TradeoffPoint> front_of(const Tradeoff& tradeoff) {
    std::vector<TradeoffPoint> front;
    std::ranges::copy_if(tradeoff.points, std::back_inserter(front), &TradeoffPoint::pareto);
    std::ranges::sort(front, {}, &TradeoffPoint::ms_per_s);
    return front;
}

Table table_of(const std::vector<TradeoffPoint>& points) {
    Table table = Table::of({"name", "modes:d", "step_s:.5f", "elements:d", "triangles:d", "ms_per_s:.3f",
                             "error:.3g", "pareto"});
    for (const TradeoffPoint& p : points)
        table.add({name_of(p.setting), modes_of(p.setting), 1.0 / p.setting.steps_per_s, p.setting.elements,
                   p.setting.triangles, p.ms_per_s, p.error, p.pareto});
    return table;
}

/// For a terminal.
std::string lines_of(const std::vector<TradeoffPoint>& points) {
    return table_of(points).part({"name", "ms_per_s", "error"}).text();
}

std::string lines_of(const std::vector<AutomaticPoint>& points) {
    Table table =
        Table::of({"asked:.3g", "estimated:.2g", "error:.2g", "ms_per_s:.3f", "over_front:.2g", "name"});
    for (const AutomaticPoint& a : points)
        table.add(
            {a.asked, a.estimated, a.point.error, a.point.ms_per_s, a.over_front, name_of(a.point.setting)});
    return table.text();
}

std::vector<TradeoffPoint> points_of(const std::vector<AutomaticPoint>& automatic) {
    std::vector<TradeoffPoint> points;
    for (const AutomaticPoint& a : automatic) points.push_back(a.point);
    return points;
}

std::string marks(const std::vector<TradeoffPoint>& points) {
    std::string text;
    for (const TradeoffPoint& p : points)
        fmt::format_to(std::back_inserter(text), "{:.5g} {:.5g}\n", p.ms_per_s, 100 * p.error);
    return text;
}

std::string json_of(const Tradeoff& tradeoff) {
    Json json;
    json["machine"] = machine_json(machine_name());
    json["results"] = Json::array();
    for (const TradeoffPoint& point : tradeoff.points) json["results"].push_back(point_json(point));
    json["automatic"] = Json::array();
    for (const AutomaticPoint& a : tradeoff.automatic) {
        json["automatic"].push_back(point_json(a.point));
        json["automatic"].back().update(
            {{"asked", a.asked}, {"estimated", a.estimated}, {"over_front", a.over_front}});
    }
    json["converged"] = {{"name", name_of(tradeoff.converged)},
                         {"finer", name_of(tradeoff.finer)},
                         {"error", tradeoff.converged_error}};
    return json_document(json);
}

std::string text_of(const Tradeoff& tradeoff) {
    std::string text = fmt::format("Pareto front\n{}\nwhat an accuracy chooses\n{}",
                                   lines_of(front_of(tradeoff)), lines_of(tradeoff.automatic));
    text += fmt::format(
        "\n{} points. Time: processor time for a simulated second of two touching bodies. Error: rms "
        "distance of their\n"
        "surface points to {}, of the largest extent;\nthat run is within {:.3f} % of {}.\n",
        tradeoff.points.size(), name_of(tradeoff.converged), 100 * tradeoff.converged_error,
        name_of(tradeoff.finer));
    return text;
}

std::string plot_commands(const Tradeoff& tradeoff) {
    PlotPanel panel;
    const auto add = [&](const std::vector<TradeoffPoint>& points, const char* look, const char* rgb,
                         const char* title) {
        panel.add(marks(points), fmt::format("with {} lc rgb '{}' title '{}'", look, rgb, title));
    };
    struct Dots {
        const char *rgb, *title;
        sim::Fidelity fidelity;
        int least_modes, most_modes;
    };
    for (const auto& [rgb, title, fidelity, least, most] :
         {Dots{"#8c8c8c", "rigid", sim::Fidelity::rigid, 0, 0},
          {"#c77c11", "linear", sim::Fidelity::linear, 6, 6},
          {"#2c7fb8", "5, 11 modes", sim::Fidelity::modal, 1, 11},
          {"#41ab5d", "14, 23 modes", sim::Fidelity::modal, 12, 23},
          {"#88419d", "45, 75 modes", sim::Fidelity::modal, 24, 1000}}) {
        std::vector<TradeoffPoint> some;
        for (const TradeoffPoint& p : tradeoff.points)
            if (p.setting.fidelity == fidelity && modes_of(p.setting) >= least && modes_of(p.setting) <= most)
                some.push_back(p);
        add(some, "points pt 7 ps 0.45", rgb, title);
    }
    add(front_of(tradeoff), "linespoints pt 6 ps 0.8 lw 1.5", "#d7301f", "Pareto front");
    add(points_of(tradeoff.automatic), "points pt 4 ps 1.6 lw 2", "#000000", "automatic");
    const auto [fastest, slowest] =
        std::ranges::minmax_element(tradeoff.points, {}, &TradeoffPoint::ms_per_s);
    if (fastest != tradeoff.points.end())
        panel.add(fmt::format("{0:.5g} {2:.5g}\n{1:.5g} {2:.5g}\n", fastest->ms_per_s, slowest->ms_per_s,
                              100 * tradeoff.converged_error),
                  "with lines dt 2 lc rgb '#8c8c8c' title 'converged to'");
    return plot_axes() +
           "set key outside right top\nset logscale xy\nset xlabel 'processor time for a simulated second "
           "[ms]'\n"
           "set ylabel 'rms error [% of the largest extent]'\n" +
           panel.text();
}

}  // namespace

std::string name_of(const TradeoffSetting& s) {
    const std::string modes = s.fidelity == sim::Fidelity::rigid    ? "rigid"
                              : s.fidelity == sim::Fidelity::linear ? "linear"
                                                                    : fmt::format("modal{}", s.modes);
    return fmt::format("{}_step1/{}_elements{}_triangles{}", modes, s.steps_per_s, s.elements, s.triangles);
}

std::vector<TradeoffSetting> all_tradeoff_settings() {
    std::vector<TradeoffSetting> settings;
    const auto add = [&](sim::Fidelity fidelity, int modes, int elements) {
        for (const int steps : {30, 60, 120, 240, 480, 960, 1920})
            for (const int triangles : {48, 360, 2000})
                settings.push_back({fidelity, modes, steps, elements, triangles});
    };
    add(sim::Fidelity::rigid, 0, 1);
    add(sim::Fidelity::linear, 6, 1);
    for (const int elements : {1, 2, 3})
        for (const int modes : {5, 11, 14, 23, 45, 75}) add(sim::Fidelity::modal, modes, elements);
    return settings;
}

void mark_pareto(std::vector<TradeoffPoint>& points) {
    std::vector<TradeoffPoint*> order;
    for (TradeoffPoint& point : points) order.push_back(&point);
    std::ranges::sort(order, {}, [](const TradeoffPoint* p) { return std::pair(p->ms_per_s, p->error); });
    double least = std::numeric_limits<double>::infinity();
    for (TradeoffPoint* point : order) {
        point->pareto = point->error < least;
        least = std::min(least, point->error);
    }
}

Tradeoff measure_tradeoff(const std::vector<TradeoffSetting>& settings, const TradeoffSetting& converged,
                          const TradeoffSetting& finer,
                          const std::function<void(const std::string&)>& progress) {
    const Probes probes;
    Tradeoff made;
    made.converged = converged;
    made.finer = finer;
    progress("converged run");
    const Run truth = run(converged, probes);
    progress("finer run");
    made.converged_error = error_of(truth.course, run(finer, probes).course);
    for (const TradeoffSetting& setting : settings) {
        if (made.points.size() % 21 == 0)
            progress(fmt::format("{} of {}: {}", made.points.size() + 1, settings.size(), name_of(setting)));
        const Run one = run(setting, probes);
        made.points.push_back({setting, one.ms_per_s, error_of(one.course, truth.course), false});
    }
    mark_pareto(made.points);

    for (const double asked : {0.2, 0.1, 0.05, 0.03, 0.02, 0.01}) {
        progress(fmt::format("accuracy {}", asked));
        AutomaticPoint automatic;
        automatic.asked = asked;
        automatic.point.setting = chosen(asked, automatic.estimated);
        const Run one = run(automatic.point.setting, probes);
        automatic.point.ms_per_s = one.ms_per_s, automatic.point.error = error_of(one.course, truth.course);
        double fastest = std::numeric_limits<double>::infinity();
        for (const TradeoffPoint& p : made.points)
            if (p.error <= automatic.point.error) fastest = std::min(fastest, p.ms_per_s);
        automatic.over_front = automatic.point.ms_per_s / fastest;
        made.automatic.push_back(automatic);
    }
    return made;
}

Figures figures_of(const Tradeoff& tradeoff) {
    return {text_of(tradeoff),
            json_of(tradeoff),
            {{"tradeoff.csv", table_of(tradeoff.points).csv()}},
            {{"tradeoff.svg", {900, 560, plot_commands(tradeoff)}}}};
}

}  // namespace app
