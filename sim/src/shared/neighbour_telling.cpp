#include "shared/neighbour_telling.h"

#include <algorithm>

#include "shared/structures.h"

namespace sim {
namespace {

constexpr double kFlatSlack = 0.1;   // of the mean size: so far apart flat bodies count as near
constexpr double kNearSlack = 1.01;  // times its radius a body counts as large

}  // namespace

NeighbourTelling::NeighbourTelling(std::size_t bodies, int bound, const WorldSettings& settings, double size)
    : bodies_(bodies),
      dt_(settings.dt),
      size_(size),
      up_(settings.gravity.normalized().cast<float>()),
      outlook_{near_steps(bound) * settings.dt, settings.dt, settings.gravity.norm()},
      outlook_of_flat_(outlook_) {
    // Those are to be known before they build something (flat_structures).
    outlook_of_flat_.time = std::max(outlook_.time, structure_outlook(bound, settings.dt));
}

void NeighbourTelling::add(std::uint32_t worker) {
    listeners_[worker].believes.assign(bodies_, Believes::anything);
}

void NeighbourTelling::heard(std::uint32_t worker, std::uint64_t step, const Reach& reach,
                             std::uint32_t epoch) {
    Listener& its = listeners_.at(worker);
    its.reach = reach, its.step = step;
    if (epoch >= its.coming_epoch) its.coming.clear();
}

void NeighbourTelling::got(std::uint32_t worker, const std::vector<WorldRecord>& bodies,
                           std::uint32_t epoch) {
    Listener& its = listeners_.at(worker);
    its.coming_epoch = epoch;
    const auto [radius, outlook] = further();
    its.coming.push_back(reach_of(bodies, radius, outlook));
    const double steps = outlook_.time / dt_;
    for (std::size_t i = 0; i < moving_.size(); ++i)
        if (is_near(i, its.coming.back(), steps))
            its.believes[static_cast<std::size_t>(moving_[i].body)] = Believes::anything;
}

void NeighbourTelling::doubt_body(int body) {
    for (auto& [worker, listener] : listeners_)
        listener.believes[static_cast<std::size_t>(body)] = Believes::anything;
}

// Further than what the application looks for, who did not know these bodies as they are now.
NeighbourTelling::Further NeighbourTelling::further() const {
    Outlook outlook = outlook_of_flat_;
    outlook.time *= 2, outlook.dt *= 2;
    return {2 * kWidest * size_, outlook};
}

Reach NeighbourTelling::reach(const std::vector<WorldRecord>& coming) const {
    if (coming.empty()) return reach_of(ways_);
    auto ways = ways_;
    for (const WorldRecord& body : coming)
        ways.emplace_back(box_of_way(body.state, further().radius, further().outlook),
                          static_cast<float>(body.state.velocity.norm()));
    return reach_of(ways);
}

void NeighbourTelling::see(int body, const WorldBodyState& state, double radius, bool asleep, bool flat) {
    moving_.push_back({body, asleep, flat});
    ways_.emplace_back(box_of_way(state, kNearSlack * radius,
                                  asleep ? Outlook{}
                                  : flat ? outlook_of_flat_
                                         : outlook_),
                       static_cast<float>(state.velocity.norm()));
}

// Whether an own body may come to what is there; `age`: steps since that was so.
bool NeighbourTelling::is_near(std::size_t which, const Reach& reach, double age) const {
    if (reach.box.isEmpty()) return false;
    const auto& [box, speed] = ways_[which];
    if (box.isEmpty()) return true;  // what is broken is near everything
    Eigen::Vector3f further =
        Eigen::Vector3f::Constant(static_cast<float>(age * dt_) * (speed + reach.speed));
    if (moving_[which].flat) {  // whatever is between them along gravity
        constexpr float kAnywhere = 1e6;
        further += kAnywhere * up_.cwiseAbs();
        further.array() += static_cast<float>(kFlatSlack * size_);
    }
    return meets({box.min() - further, box.max() + further}, reach);
}

std::span<const std::size_t> NeighbourTelling::choose(std::uint32_t worker, std::uint64_t step) {
    Listener& to = listeners_.at(worker);
    const double age = to.step < step ? static_cast<double>(step - to.step) : 0;
    const auto near_any = [&](std::size_t i) {
        return is_near(i, to.reach, age) ||
               std::ranges::any_of(to.coming, [&](const Reach& reach) { return is_near(i, reach, age); });
    };
    chosen_.clear();
    for (std::size_t i = 0; i < moving_.size(); ++i) {
        Believes& believes = to.believes[static_cast<std::size_t>(moving_[i].body)];
        if (moving_[i].asleep && believes == Believes::asleep) continue;
        if (believes == Believes::awake && !near_any(i)) continue;
        believes = moving_[i].asleep ? Believes::asleep : Believes::awake;
        chosen_.push_back(i);
    }
    return chosen_;
}

}  // namespace sim
