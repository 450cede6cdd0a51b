#include "simulate/run_measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

namespace app {
namespace {

constexpr std::size_t kMostPoints = 4000;
constexpr int kWidth = 900, kPanel = 260, kFrame = 56;

/// A line colour for each worker, repeating after the tenth: "rgb '#rrggbb'".
std::string worker_colour(std::size_t number) {
    constexpr std::array<const char*, 10> kColours = {"#2468b4", "#c07a12", "#2b9a48", "#6b46c1", "#e03131",
                                                      "#0f8a8a", "#b5179e", "#5d6874", "#8a5a2b", "#7c8fd6"};
    return fmt::format("rgb '{}'", kColours[number % kColours.size()]);
}

std::string lines(const std::vector<WorkerHistory::Point>& points, bool seconds) {
    std::string text;
    for (const WorkerHistory::Point& p : points)
        seconds ? fmt::format_to(std::back_inserter(text), "{} {:.6g}\n", p.step, 1e3 * p.seconds)
                : fmt::format_to(std::back_inserter(text), "{} {}\n", p.step, p.bodies);
    return text;
}

std::string panel(const WorkerHistory& history, bool seconds) {
    PlotPanel panel;
    for (const auto& [worker, points] : history.workers())
        panel.add(lines(points, seconds),
                  fmt::format("with {} lw 1.4 lc {} title 'worker {}'", seconds ? "lines" : "steps",
                              worker_colour(static_cast<std::size_t>(worker)), worker));
    return panel.text();
}

}  // namespace

MomentumWatch::MomentumWatch(const sim::WorldScene& scene, const sim::World& world, bool rounded)
    : scene_(scene), rounded_(rounded) {
    closed_ = scene.world.planes.empty() && scene.events.empty() && scene.world.forces.empty();
    for (const sim::PointConstraint& c : scene.world.constraints) closed_ = closed_ && c.body_b >= 0;
    for (int body = 0; closed_ && body < world.bodies(); ++body) {
        const sim::WorldBody& definition = world.definition(body);
        closed_ = definition.moves() && definition.damping_alpha == 0;
        weight_ += world.rigid_mass(body).mass * definition.gravity_scale * scene.world.settings.gravity;
    }
    momentum_ = world.momentum(), angular_momentum_ = world.angular_momentum();
    look(world);
}

void MomentumWatch::look(const sim::World& world) {
    double sum = 0;
    for (int body = 0; body < world.bodies(); ++body)
        if (world.definition(body).moves())
            sum += world.rigid_mass(body).mass * world.state(body).velocity.norm();
    largest_.scale = std::max(largest_.scale, sum);
    gained_ = world.momentum() - momentum_ - brought(world);
    if (!closed_) return;
    if (rounded_) largest_.linear = largest_.angular = 0;
    largest_.linear = std::max(largest_.linear, (gained_ - weight_ * world.time_s()).norm());
    if (weight_.isZero())
        largest_.angular = std::max(largest_.angular, (world.angular_momentum() - angular_momentum_).norm());
}

/// Momentum of bodies that came later, as they came.
Eigen::Vector3d MomentumWatch::brought(const sim::World& world) const {
    Eigen::Vector3d sum(0, 0, 0);
    for (int body = static_cast<int>(scene_.world.bodies.size()); body < world.bodies(); ++body)
        if (world.definition(body).moves())
            sum += world.rigid_mass(body).mass * world.definition(body).velocity;
    return sum;
}

std::optional<MomentumDrift> MomentumWatch::drift(const std::optional<Eigen::Vector3d>& outside) const {
    if (closed_)
        return MomentumDrift{largest_.linear,
                             weight_.isZero() ? std::optional(largest_.angular) : std::nullopt,
                             largest_.scale};
    if (!outside) return {};
    return MomentumDrift{(gained_ - *outside).norm(), {}, largest_.scale};
}

void WorkerHistory::add(const sim::WorkerStep& step) {
    if (step.step % every_ != 0) return;
    std::vector<Point>& points = workers_[step.worker];
    points.push_back({step.step, step.bodies, step.seconds});
    if (points.size() < kMostPoints) return;
    every_ *= 2;
    for (auto& [worker, kept] : workers_)
        std::erase_if(kept, [&](const Point& p) { return p.step % every_ != 0; });
}

PlotScript workers_plot(const WorkerHistory& history) {
    constexpr int kHeight = 2 * kPanel + kFrame;
    std::string commands = plot_axes() +
                           "set key outside right top\nset multiplot\nset lmargin at screen "
                           "0.085\nset rmargin at screen 0.86\nset yrange [0:]\n";
    commands += plot_margins(12, kPanel - 12, kHeight) + "set format x ''\nset ylabel 'bodies per worker'\n" +
                panel(history, false);
    commands += plot_margins(kPanel + 12, 2 * kPanel - 6, kHeight) +
                "unset key\nset format x '%g'\nset xlabel 'step'\nset ylabel 'ms per step'\n" +
                panel(history, true);
    return {kWidth, kHeight, commands + "unset multiplot\n"};
}

}  // namespace app
