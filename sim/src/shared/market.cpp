#include "shared/market.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace sim {
namespace {

constexpr double kLevel = 0.15;  // of the average
// Once level: what is not any more. Bodies that meet cost more, which comes and goes; a processor that
// became slower stays so.
constexpr double kLastingLevel = 0.5;  // of the average, for so many steps in a row
constexpr int kLastingSteps = 5;
constexpr int kLevelSteps = 4;       // after which it counts as level
constexpr double kOtherRate = 0.25;  // change of the seconds a unit of work, for so many steps in a row
constexpr int kOtherRateSteps = 2;
constexpr std::uint64_t kTuningSteps = 20;  // once level, at least so many between trades

}  // namespace

double exchange_rate(double seller_body_cost, double buyer_body_cost) {
    if (seller_body_cost <= 0 || buyer_body_cost <= 0) return 1;
    return std::clamp(buyer_body_cost / seller_body_cost, 0.1, 10.0);
}

Market::Market(std::uint32_t self, const MarketSettings& settings, bool near_only)
    : self_(self),
      settings_(settings),
      near_only_(near_only),
      weight_(1 - std::exp(-1 / std::max(settings.smoothing_steps, 1e-3))) {
    workers_[self];
}

void Market::members(const std::vector<std::uint32_t>& workers) {
    auto there = [&workers](std::uint32_t worker) {
        return std::find(workers.begin(), workers.end(), worker) != workers.end();
    };
    std::erase_if(workers_, [&](const auto& w) { return w.first != self_ && !there(w.first); });
    std::erase_if(promises_, [&](const auto& p) { return !there(p.first); });
    for (const std::uint32_t worker : workers) workers_[worker];
    // What was handed over is taken or comes back: its registration arrives in any case.
    if (!there(offer_.to)) sale_ = Sale::none;
}

void Market::heard(std::uint32_t worker, std::uint32_t epoch, const StepReport& report) {
    const auto found = workers_.find(worker);
    if (found == workers_.end() || worker == self_ || epoch < found->second.epoch) return;
    found->second.smoothed = report.smoothed_s;
    found->second.own = static_cast<int>(report.own);
}

void Market::credit(Worker& worker, int bodies, double cost) {
    worker.own = std::max(0, worker.own + bodies);
    worker.smoothed = worker.own == 0 ? 0 : std::max(0.0, worker.smoothed + cost);
}

void Market::registered(std::uint32_t epoch, const Ownership& ownership) {
    if (ownership.traded) traded_ = true, last_trade_ = std::max(last_trade_, ownership.step);
    const auto from = workers_.find(ownership.from), to = workers_.find(ownership.owner);
    const int bodies = static_cast<int>(ownership.bodies.size());
    // Seconds a step, at the seller and at the buyer.
    double sold = from == workers_.end() ? 0 : bodies * from->second.body_cost();
    const bool own_sale = ownership.from == self_ && handed_over_ > 0;
    if (own_sale) sold = std::exchange(handed_over_, 0);
    double bought = to == workers_.end() ? 0 : bodies * to->second.body_cost();
    if (from != workers_.end() && to != workers_.end())
        bought = sold * exchange_rate(from->second.body_cost(), to->second.body_cost());
    if (const auto promise = promises_.find(ownership.from);
        ownership.owner == self_ && promise != promises_.end()) {
        bought = promise->second;
        promises_.erase(promise);
    }
    if (from != workers_.end()) {
        from->second.epoch = epoch;
        if (ownership.from != self_) credit(from->second, -bodies, -sold);
    }
    if (to != workers_.end()) {
        to->second.epoch = epoch;
        if (!own_sale || ownership.owner == self_) credit(to->second, bodies, bought);
    }
    if (ownership.owner == self_ && bought > 0) known_ = true;
}

void Market::worked(std::uint64_t step, double seconds, double work, int own) {
    if (step <= step_) return;  // repeated, with more bodies: not what a step takes
    step_ = step;
    Worker& self = workers_[self_];
    self.own = own;
    self.smoothed = known_ ? self.smoothed + weight_ * (seconds - self.smoothed) : seconds;
    known_ = own > 0;
    if (own == 0) self.smoothed = 0;
    const double rate = work > 0 ? seconds / work : 0;
    if (changed_speed(rate)) self.smoothed = seconds;
    watch_level();
}

bool Market::changed_speed(double rate) {
    const bool other = usual_rate_ > 0 && std::abs(rate - usual_rate_) > kOtherRate * usual_rate_;
    other_rate_steps_ = other ? other_rate_steps_ + 1 : 0;
    if (!other && calm_ && rate > 0)
        usual_rate_ = usual_rate_ > 0 ? usual_rate_ + weight_ * (rate - usual_rate_) : rate;
    if (other_rate_steps_ < kOtherRateSteps) return false;
    calm_ = false;
    level_steps_ = 0;
    usual_rate_ = 0;
    return true;
}

double Market::average() const {
    const double sum = std::accumulate(workers_.begin(), workers_.end(), 0.0,
                                       [](double s, const auto& w) { return s + w.second.smoothed; });
    return sum / static_cast<double>(workers_.size());
}

double Market::allowance(const Worker& worker) const {
    return std::max(kLevel * average(), worker.body_cost());
}

bool Market::level() const {
    const double mean = average();
    return std::all_of(workers_.begin(), workers_.end(), [&](const auto& w) {
        return std::abs(w.second.smoothed - mean) <=
               std::max(allowance(w.second), allowance(workers_.at(self_)));
    });
}

bool Market::slowest() const {
    return std::all_of(workers_.begin(), workers_.end(),
                       [this](const auto& w) { return w.first == self_ || w.second.smoothed < smoothed(); });
}

void Market::watch_level() {
    const Worker& self = workers_.at(self_);
    const double excess = self.smoothed - average();
    const bool far = excess > std::max(kLastingLevel * average(), 1.5 * self.body_cost());
    far_steps_ = far ? far_steps_ + 1 : 0;
    if (far_steps_ >= kLastingSteps) calm_ = false, level_steps_ = 0;
    level_steps_ = level() ? level_steps_ + 1 : 0;
    if (level_steps_ >= kLevelSteps) calm_ = true;
}

bool Market::tuning() const {
    return calm_ || level();
}

// Seconds to be sold now.
double Market::wanted() const {
    const double mean = average(), excess = smoothed() - mean;
    if (excess <= settings_.dead_band * mean) return 0;
    if (!tuning()) return excess / std::max(1.0, static_cast<double>(workers_.size()) - 2);
    const bool due = !traded_ || step_ >= last_trade_ + kTuningSteps;
    return due && slowest() ? workers_.at(self_).body_cost() : 0;
}

bool Market::wants_to_sell() const {
    return settings_.trade && step_ >= settings_.from_step && step_ >= not_before_ && sale_ == Sale::none &&
           workers_.size() > 1 && known_ && wanted() > 0;
}

std::uint32_t Market::fastest() const {
    std::uint32_t best = self_;
    for (const auto& [number, worker] : workers_)
        if (number != self_ && (best == self_ || worker.smoothed < workers_.at(best).smoothed)) best = number;
    return best;
}

std::optional<Offer> Market::make_offer(std::vector<ReplicaProtocol::Lot> lots) {
    const Worker& self = workers_.at(self_);
    const std::uint32_t to = fastest();
    const Worker& buyer = workers_.at(to);
    const double rate = exchange_rate(self.body_cost(), buyer.body_cost());
    const double most = (self.smoothed - buyer.smoothed) / (1 + rate);  // then both take as long
    // What makes the buyer as slow as the average, or one lot.
    const double room = std::max((average() - buyer.smoothed) / rate, self.body_cost());
    const double due = tuning() ? 1.5 * wanted() : wanted() + carried_;
    // Their costs are smoothed, too; all together they are what a step takes.
    const double sum = std::accumulate(lots.begin(), lots.end(), 0.0,
                                       [](double s, const auto& lot) { return s + lot.cost_s; });
    for (ReplicaProtocol::Lot& lot : lots) lot.cost_s *= sum > 0 ? self.smoothed / sum : 1;
    std::sort(lots.begin(), lots.end(), [](const auto& a, const auto& b) {
        return std::pair(-a.pull, a.bodies) < std::pair(-b.pull, b.bodies);
    });
    offer_ = {to, next_number_, {}, {}};
    offer_cost_ = 0;
    const bool level = self.smoothed - average() <= allowance(self);
    for (const ReplicaProtocol::Lot& lot : lots) {
        // Far from the buyer's bodies it costs both more: only where times differ too much.
        if (near_only_ && level && lot.pull < 0) break;
        if (offer_cost_ + lot.cost_s > std::min({due, most, room}) * (1 + 1e-9)) continue;
        offer_cost_ += lot.cost_s;
        for (const std::uint32_t body : lot.bodies) {
            offer_.bodies.push_back(body);
            offer_.cost_s.push_back(static_cast<float>(lot.cost_s / static_cast<double>(lot.bodies.size())));
        }
        if (tuning()) break;
    }
    carried_ = tuning() ? 0 : std::clamp(due - offer_cost_, 0.0, self.body_cost());
    if (offer_.bodies.empty()) return std::nullopt;
    ++next_number_;
    sale_ = Sale::offered;
    return offer_;
}

void Market::answered(std::uint32_t worker, const OfferAnswer& answer) {
    if (sale_ != Sale::offered || worker != offer_.to || answer.number != offer_.number) return;
    sale_ = answer.accepted ? Sale::accepted : Sale::none;
    if (!answer.accepted) carried_ = 0, not_before_ = step_ + 2;
}

std::optional<Offer> Market::hand_over() {
    if (sale_ != Sale::accepted || handed_over_ > 0) return std::nullopt;
    sale_ = Sale::none;
    traded_ = true, last_trade_ = step_;
    handed_over_ = offer_cost_;
    Worker &self = workers_[self_], &buyer = workers_[offer_.to];
    const int bodies = static_cast<int>(offer_.bodies.size());
    const double bought = offer_cost_ * exchange_rate(self.body_cost(), buyer.body_cost());
    credit(self, -bodies, -offer_cost_);
    credit(buyer, bodies, bought);
    buyer.epoch = std::numeric_limits<std::uint32_t>::max();  // until it is registered
    return offer_;
}

OfferAnswer Market::answer(std::uint32_t seller, const Offer& offer) {
    promises_.erase(seller);  // it has one offer at a time
    OfferAnswer answer{seller, offer.number, false};
    const auto found = workers_.find(seller);
    if (found == workers_.end() || (calm_ && !promises_.empty())) return answer;
    const Worker& self = workers_.at(self_);
    const double cost = std::accumulate(offer.cost_s.begin(), offer.cost_s.end(), 0.0);
    const double here = cost * exchange_rate(found->second.body_cost(), self.body_cost());
    double after = self.smoothed + here;
    for (const auto& promise : promises_) after += promise.second;
    answer.accepted = after <= (1 + settings_.dead_band) * (found->second.smoothed - cost);
    if (answer.accepted) promises_[seller] = here;
    return answer;
}

}  // namespace sim
