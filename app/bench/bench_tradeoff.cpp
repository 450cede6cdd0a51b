#include "bench/bench_tradeoff.h"

#include <fmt/format.h>
#include <sim/surface_mesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "bench/machine_speed.h"
#include "process/clock.h"

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
    body.fidelity.impact_mps = 1.5;
    body.damping_ratio = 0.2;
    body.triangles = setting.triangles;
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
    for (int moment = 0; moment < kMoments; ++moment) {
        const double begin = thread_cpu_s();
        for (int i = 0; i < setting.steps_per_s / kMomentsPerSecond; ++i) world.step();
        spent += thread_cpu_s() - begin;
        probes.append(world, made.course, column);
    }
    int runs = 1;
    for (; spent < kLeastMeasured_s; ++runs) {
        sim::World again(definition);
        const double begin = thread_cpu_s();
        for (int i = 0; i < kMoments * setting.steps_per_s / kMomentsPerSecond; ++i) again.step();
        spent += thread_cpu_s() - begin;
    }
    made.ms_per_s = 1e3 * spent / runs / kSeconds;
    return made;
}

double error_of(const Course& course, const Course& truth) {
    const double extent = 2 * soft_body({}).shape.base.semi_axes.maxCoeff();
    return std::sqrt((course - truth).squaredNorm() / static_cast<double>(truth.cols())) / extent;
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

TradeoffSetting converged_setting() {
    return {sim::Fidelity::modal, 75, 3840, 3, 2000};
}

TradeoffSetting finer_setting() {
    return {sim::Fidelity::modal, 120, 7680, 3, 4000};
}

void mark_pareto(std::vector<TradeoffPoint>& points) {
    std::vector<TradeoffPoint*> order;
    for (TradeoffPoint& point : points) order.push_back(&point);
    std::sort(order.begin(), order.end(), [](const TradeoffPoint* a, const TradeoffPoint* b) {
        return a->ms_per_s != b->ms_per_s ? a->ms_per_s < b->ms_per_s : a->error < b->error;
    });
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

    const sim::WorldBody body = soft_body({sim::Fidelity::automatic});
    const sim::FidelityChoice choice = sim::choose_fidelity(body.shape.base, body.material, body.fidelity);
    made.requested_error = body.fidelity.error;
    made.automatic.setting.fidelity = choice.fidelity;
    made.automatic.setting.modes = choice.modes;
    const Run automatic = run(made.automatic.setting, probes);
    made.automatic.ms_per_s = automatic.ms_per_s;
    made.automatic.error = error_of(automatic.course, truth.course);
    return made;
}

}  // namespace app
