#include "simulate/kept_accuracy.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numeric>

#include "files/bad_input.h"

namespace app {
namespace {

constexpr std::size_t kMostBodies = 8;  // that are named
using Json = nlohmann::ordered_json;

std::string parts_of(const sim::BodyError& e) {
    return fmt::format("step {:.2g}, truncation {:.2g}, mesh {:.2g}, linearity {:.2g}, samples {:.2g}",
                       e.step, e.truncation, e.mesh, e.linearity, e.sampling);
}

}  // namespace

std::vector<std::size_t> KeptAccuracy::worst_first() const {
    std::vector<std::size_t> order(report.bodies.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, std::ranges::greater(),
                             [this](std::size_t b) { return report.bodies[b].total(); });
    return order;
}

bool KeptAccuracy::is_kept() const {
    return std::ranges::all_of(
        report.bodies, [this](const sim::BodyError& e) { return e.total() <= report.accuracy * (1 + 1e-9); });
}

std::vector<std::string> KeptAccuracy::lines() const {
    const std::vector<std::size_t> order = worst_first();
    if (order.empty()) return {};
    const sim::BodyError& worst = report.bodies[order[0]];
    const auto beyond = static_cast<std::size_t>(std::ranges::count_if(
        report.bodies, [this](const sim::BodyError& e) { return e.total() > report.accuracy; }));
    const std::string who = fmt::format("{} {:.2g} ({}; loaded at {:.3g} s)", names[order[0]], worst.total(),
                                        parts_of(worst), worst.loaded_s);
    const std::string how =
        fmt::format("a step in {}, after {}", counted(std::size_t(report.step_parts), "part"),
                    counted(std::size_t(report.trials), "trial"));
    if (is_kept()) return {fmt::format("accuracy {}: estimated {}; {}", report.accuracy, who, how)};
    std::vector<std::string> lines = {fmt::format("accuracy {} is not kept by {} of {}: estimated {}; {}",
                                                  report.accuracy, beyond,
                                                  counted(report.bodies.size(), "body"), who, how)};
    if (report.parted_s)
        lines.push_back(fmt::format("from {:.3g} s on paths hang on the length of the step: {} first",
                                    *report.parted_s, names[std::size_t(report.parted_body)]));
    return lines;
}

Json KeptAccuracy::json() const {
    const std::vector<std::size_t> order = worst_first();
    Json bodies = Json::array();
    for (std::size_t i = 0; i < std::min(order.size(), kMostBodies); ++i) {
        const sim::BodyError& e = report.bodies[order[i]];
        bodies.push_back({{"body", names[order[i]]},
                          {"error", e.total()},
                          {"step", e.step},
                          {"truncation", e.truncation},
                          {"mesh", e.mesh},
                          {"linearity", e.linearity},
                          {"samples", e.sampling},
                          {"loaded_s", e.loaded_s}});
    }
    return {{"asked", report.accuracy},
            {"kept", is_kept()},
            {"estimated", order.empty() ? 0 : report.bodies[order[0]].total()},
            {"step_parts", report.step_parts},
            {"trials", report.trials},
            {"parted_s", report.parted_s ? Json(*report.parted_s) : Json()},
            {"worst", bodies}};
}

}  // namespace app
