#include "shared/border_selection.h"

#include <algorithm>

#include "shared/structures.h"

namespace sim {
namespace {

constexpr double kFlatSlack = 0.1;   // flat bodies this far apart count as near, in mean sizes
constexpr double kNearSlack = 1.01;  // factor of a body's radius

}  // namespace

BorderSelection::BorderSelection(std::size_t bodies, int bound, const WorldSettings& settings, double size)
    : bodies_(bodies),
      dt_(settings.dt),
      size_(size),
      up_(settings.gravity.normalized().cast<float>()),
      outlook_{near_steps(bound) * settings.dt, settings.dt, settings.gravity.norm()},
      outlook_of_flat_(outlook_) {
    // Flat bodies have to be known before they build a structure (flat_structures).
    outlook_of_flat_.time = std::max(outlook_.time, structure_outlook(bound, settings.dt));
}

void BorderSelection::set_reach(std::uint32_t worker, std::uint64_t step, const Reach& reach,
                                std::uint32_t epoch) {
    Neighbour& neighbour = neighbours_.at(worker);
    neighbour.reach = reach, neighbour.step = step;
    if (epoch >= neighbour.gained_epoch) neighbour.gained.clear();
}

// What is near these bodies the worker may have from the application.
void BorderSelection::add_gained(std::uint32_t worker, const std::vector<WorldRecord>& bodies,
                                 std::uint32_t epoch) {
    Neighbour& neighbour = neighbours_.at(worker);
    neighbour.gained_epoch = epoch;
    const auto [radius, outlook] = margin_of_gained();
    neighbour.gained.push_back(reach_of(bodies, radius, outlook));
    const double steps = outlook_.time / dt_;
    for (std::size_t i = 0; i < own_.size(); ++i)
        if (is_near(i, neighbour.gained.back(), steps))
            neighbour.sent[static_cast<std::size_t>(own_[i].body)] = Sent::unknown;
}

void BorderSelection::invalidate(int body) {
    for (auto& [worker, neighbour] : neighbours_)
        neighbour.sent[static_cast<std::size_t>(body)] = Sent::unknown;
}

// Wider than the application's (Coordinator::add_surroundings), whose states of these bodies are older.
BorderSelection::Margin BorderSelection::margin_of_gained() const {
    Outlook outlook = outlook_of_flat_;
    outlook.time *= 2, outlook.dt *= 2;
    return {2 * kWidest * size_, outlook};
}

Reach BorderSelection::reach(const std::vector<WorldRecord>& future) const {
    if (future.empty()) return reach_of(ways_);
    auto ways = ways_;
    const auto [radius, outlook] = margin_of_gained();
    for (const WorldRecord& body : future)
        ways.emplace_back(box_of_way(body.state, radius, outlook),
                          static_cast<float>(body.state.velocity.norm()));
    return reach_of(ways);
}

void BorderSelection::add_own(int body, const WorldBodyState& state, double radius, bool asleep, bool flat) {
    own_.push_back({body, asleep, flat});
    const Outlook outlook = asleep ? Outlook{} : flat ? outlook_of_flat_ : outlook_;
    ways_.emplace_back(box_of_way(state, kNearSlack * radius, outlook),
                       static_cast<float>(state.velocity.norm()));
}

// Whether an own body may come near what is in a reach; `age`: steps since the reach was written.
bool BorderSelection::is_near(std::size_t which, const Reach& reach, double age) const {
    if (reach.box.isEmpty()) return false;
    const auto& [box, speed] = ways_[which];
    if (box.isEmpty()) return true;  // a broken body is near everything
    Eigen::Vector3f margin = Eigen::Vector3f::Constant(static_cast<float>(age * dt_) * (speed + reach.speed));
    if (own_[which].flat) {  // flat bodies are near at any distance along gravity
        constexpr float kAnywhere = 1e6;
        margin += kAnywhere * up_.cwiseAbs();
        margin.array() += static_cast<float>(kFlatSlack * size_);
    }
    return meets({box.min() - margin, box.max() + margin}, reach);
}

std::span<const std::size_t> BorderSelection::select(std::uint32_t worker, std::uint64_t step) {
    Neighbour& to = neighbours_.at(worker);
    const double age = to.step < step ? static_cast<double>(step - to.step) : 0;
    const auto is_near_any = [&](std::size_t i) {
        return is_near(i, to.reach, age) ||
               std::ranges::any_of(to.gained, [&](const Reach& reach) { return is_near(i, reach, age); });
    };
    selected_.clear();
    for (std::size_t i = 0; i < own_.size(); ++i) {
        Sent& sent = to.sent[static_cast<std::size_t>(own_[i].body)];
        if (own_[i].asleep && sent == Sent::asleep) continue;
        if (sent == Sent::awake && !is_near_any(i)) continue;
        sent = own_[i].asleep ? Sent::asleep : Sent::awake;
        selected_.push_back(i);
    }
    return selected_;
}

}  // namespace sim
