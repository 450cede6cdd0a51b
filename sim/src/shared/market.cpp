#include "shared/market.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

namespace sim {
namespace {

// Above the average of the others, as a share of it, for so many steps in a row. Bodies that meet cost more, and
// a processor may be unsteady, which comes and goes; one that became slower stays so.
constexpr double kFar = 0.5;
constexpr int kFarSteps = 10;
constexpr double kNear = 0.03;      // until then, as a share of the average of all
constexpr double kFarBodies = 1.5;  // by at least so many bodies' cost
// From turn to turn. A sale is registered within some five steps of its turn's first, so two sales are twenty steps apart or
// more.
constexpr int kTurnSteps = 25;
constexpr std::uint64_t kHomeTurns = 4;  // of so many turns one is for bodies that go home, at least
constexpr int kAmong = 3;                // sides a body by which the border becomes shorter, at least
constexpr std::uint64_t kDeclinedSteps = 3, kNothingSteps = 5;  // to the next offer
// So much of own work is sold at most before it shows whether that helps: what a body costs may lie in what it
// touches, and stay.
constexpr double kGo = 0.3, kGoLeast = 0.05;
constexpr std::uint64_t kJudgeSteps = 10, kPatience = 80;
constexpr double kWorthwhile = 0.25;  // of the mean lot's cost: sold for less it helps nobody

}  // namespace

Market::Market(std::uint32_t self, const MarketSettings& settings, int bound)
    : self_(self),
      settings_(settings),
      turn_steps_(static_cast<std::uint64_t>(std::max(kTurnSteps, bound + 1))),
      patience_(kPatience) {
    workers_[self];
}

void Market::members(const std::vector<std::uint32_t>& workers) {
    auto there = [&workers](std::uint32_t worker) {
        return std::find(workers.begin(), workers.end(), worker) != workers.end();
    };
    std::erase_if(workers_, [&](const auto& w) { return w.first != self_ && !there(w.first); });
    std::erase_if(promises_, [&](const auto& p) { return !there(p.first); });
    for (const std::uint32_t worker : workers)
        if (const auto [entry, fresh] = workers_.try_emplace(worker); fresh)
            entry->second.answers = step_ == 0;
    // What was handed over is taken or comes back: its registration arrives in any case.
    if (!there(offer_.to)) sale_ = Sale::none;
}

void Market::heard(const MessageHeader& header, double smoothed_s, std::uint32_t own) {
    const auto found = workers_.find(header.worker);
    if (found == workers_.end() || header.worker == self_) return;
    found->second.answers = true;
    mark(found->second, header.step, smoothed_s);
    if (header.epoch < found->second.epoch) return;
    found->second.smoothed = smoothed_s;
    found->second.own = static_cast<int>(own);
}

void Market::credit(Worker& worker, int bodies, double cost) {
    worker.own = std::max(0, worker.own + bodies);
    const double before = worker.smoothed;
    worker.smoothed = worker.own == 0 ? 0 : std::max(0.0, worker.smoothed + cost);
    if (&worker == &workers_[self_] && before > 0) work_ *= worker.smoothed / before;
}

void Market::registered(std::uint32_t epoch, const Ownership& ownership) {
    const auto from = workers_.find(ownership.from), to = workers_.find(ownership.owner);
    const int bodies = static_cast<int>(ownership.bodies.size());
    double cost = 0;  // [s]
    if (from != workers_.end() && from->second.own > 0)
        cost = bodies * from->second.smoothed / from->second.own;
    const bool own_sale = ownership.from == self_ && handed_over_;
    if (own_sale) cost = *std::exchange(handed_over_, std::nullopt);
    if (const auto promise = promises_.find(ownership.from);
        ownership.owner == self_ && promise != promises_.end()) {
        cost = promise->second.front();
        promise->second.pop_front();
        if (promise->second.empty()) promises_.erase(promise);
    }
    if (from != workers_.end()) {
        from->second.epoch = epoch;
        if (ownership.from != self_) credit(from->second, -bodies, -cost);
    }
    if (to != workers_.end()) {
        to->second.epoch = epoch;
        if (!own_sale || ownership.owner == self_) credit(to->second, bodies, cost);
    }
    if (ownership.owner == self_) go_.hoped += cost;
}

void Market::worked(std::uint64_t step, double seconds, double work, int own) {
    Worker& self = workers_[self_];
    if (step <= step_) {  // the last one, told once more: not what a step takes
        if (step == step_) mark(self, step, static_cast<float>(self.smoothed));
        return;
    }
    step_ = step;
    self.own = own;
    work = std::max(work, 1.0);  // bodies that sleep are looked after
    if (own == 0) {
        steps_known_ = self.smoothed = work_ = 0;
    } else if (steps_known_ == 0) {
        // What was bought costs as was told, as if for some steps.
        const bool told = self.smoothed > 0;
        many_seconds_ = told ? self.smoothed : seconds;
        work_ = many_work_ = work;
        steps_known_ = told ? settings_.smoothing_steps / 4 : 1;
    } else {
        steps_known_ = std::min(steps_known_ + 1, settings_.smoothing_steps);
        many_seconds_ += (seconds - many_seconds_) / steps_known_;
        many_work_ += (work - many_work_) / steps_known_;
        work_ += (work - work_) / std::min(steps_known_, BodyCosts::kSmoothing);
    }
    if (own > 0) self.smoothed = work_ * many_seconds_ / many_work_;
    mark(self, step_, static_cast<float>(self.smoothed));  // as the others hear it
    watch_level();
    take_turn();
}

double Market::average() const {
    const double sum = std::accumulate(workers_.begin(), workers_.end(), 0.0,
                                       [](double s, const auto& w) { return s + w.second.smoothed; });
    return sum / static_cast<double>(workers_.size());
}

bool Market::above(const Worker& worker) const {
    return worker.smoothed > (1 + settings_.dead_band) * average();
}

void Market::mark(Worker& worker, std::uint64_t step, double smoothed) const {
    if (step % turn_steps_ == 0) worker.marks[step / turn_steps_ % worker.marks.size()] = {step, smoothed};
}

// By what all reported when the turn before began, so that all agree on whose it is. Several columns are sold only for what was
// above the average in the turn before that, too.
void Market::take_turn() {
    turn_ = Turn::none;
    lasting_ = 0;
    const std::uint64_t turn = step_ / turn_steps_;
    if (step_ % turn_steps_ != 0 || turn < 3) return;
    std::vector<std::uint32_t> all;
    std::array<std::map<std::uint32_t, double>, 2> shares;  // of the average
    for (std::uint64_t before : {1, 2}) {
        std::map<std::uint32_t, double>& share = shares[before - 1];
        double sum = 0;
        for (const auto& [number, worker] : workers_) {
            const Worker::Mark& then = worker.marks[(turn - before) % worker.marks.size()];
            if (then.step != step_ - before * turn_steps_) continue;  // owned nothing
            share[number] = then.smoothed;
            sum += then.smoothed;
        }
        if (before == 1 && !(sum > 0)) return;
        for (auto& of : share) of.second *= static_cast<double>(workers_.size()) / sum;
    }
    std::vector<std::pair<double, std::uint32_t>> sellers;  // share, number
    for (const auto& [number, share] : shares[0]) {
        all.push_back(number);
        const auto before = shares[1].find(number);
        if (share > 1 + settings_.dead_band) sellers.emplace_back(share, number);
        if (number == self_ && before != shares[1].end()) lasting_ = std::min(share, before->second) - 1;
    }
    if (all.empty()) return;
    std::ranges::sort(sellers, std::greater());
    if (!sellers.empty() && turn % kHomeTurns != 0) {
        const std::size_t others = sellers.size() - 1;
        const std::size_t place = turn % 2 == 1 || others == 0 ? 0 : 1 + turn / kHomeTurns % others;
        if (sellers[place].second == self_) turn_ = Turn::sale;
    } else if (all[(sellers.empty() ? turn : turn / kHomeTurns) % all.size()] == self_) {
        turn_ = Turn::home;
    }
}

// If own time has come back by more than half of what was sold, as far as smoothing shows it.
void Market::judge() {
    if (go_.judged_at == 0 || step_ < go_.judged_at) return;
    const double shown = 1 - std::exp(-static_cast<double>(kJudgeSteps) / settings_.smoothing_steps);
    const bool helped = go_.sold < kGoLeast * smoothed() || smoothed() - go_.hoped < 0.5 * shown * go_.sold;
    if (!helped) not_before_ = step_ + patience_;
    patience_ = helped ? kPatience : 4 * patience_;
    go_ = {};
}

void Market::watch_level() {
    judge();
    const Worker& self = workers_.at(self_);
    const bool idle =
        std::any_of(workers_.begin(), workers_.end(), [](const auto& w) { return w.second.own == 0; });
    const auto others = std::max(1.0, static_cast<double>(workers_.size()) - 1);
    const double theirs = (average() * static_cast<double>(workers_.size()) - self.smoothed) / others;
    const double body = self.own > 0 ? self.smoothed / self.own : 0;
    const bool far = self.smoothed - theirs > std::max(kFar * theirs, kFarBodies * body);
    far_steps_ = far ? far_steps_ + 1 : 0;
    if (self.smoothed <= (1 + kNear) * average()) free_ = spreads_ = false;
    if (far && idle) spreads_ = true;
    if (far_steps_ >= kFarSteps || spreads_) free_ = true;
}

bool Market::wants_less() const {
    if (spreads_) return true;
    if (steps_known_ < settings_.smoothing_steps / 2) return false;
    return free_ || (turn_ == Turn::sale && above(workers_.at(self_)));
}

bool Market::wants_to_sell() const {
    return settings_.trade && step_ >= settings_.from_step && step_ >= not_before_ && sale_ == Sale::none &&
           workers_.size() > 1 && steps_known_ > 0 && (wants_less() || turn_ == Turn::home);
}

// The fastest neighbour; self: none is faster.
std::uint32_t Market::buyer(const Neighbours& neighbours) const {
    std::set<std::uint32_t> near{self_};
    if (const auto own = neighbours.find(self_); own != neighbours.end())
        near.insert(own->second.begin(), own->second.end());
    std::set<std::uint32_t> reached = near;
    for (std::size_t before = 0; before != reached.size();) {
        before = reached.size();
        for (const auto& [worker, others] : neighbours)
            if (reached.count(worker) > 0) reached.insert(others.begin(), others.end());
    }
    const double mean = average();
    const bool apart = std::none_of(reached.begin(), reached.end(), [&](std::uint32_t worker) {
        const auto found = workers_.find(worker);
        return found != workers_.end() && found->second.smoothed < mean;
    });
    std::uint32_t best = self_;
    for (const auto& [number, worker] : workers_)
        if ((apart || worker.own == 0 || near.count(number) > 0) &&
            worker.smoothed < workers_.at(best).smoothed)
            best = number;
    return best;
}

// Whether a worker has a faster neighbour.
bool Market::passes_on(std::uint32_t worker, const Neighbours& neighbours) const {
    const auto near = neighbours.find(worker);
    return near != neighbours.end() && std::ranges::any_of(near->second, [&](std::uint32_t other) {
               const auto found = workers_.find(other);
               return found != workers_.end() && found->second.smoothed < workers_.at(worker).smoothed;
           });
}

int Market::sellers(std::uint32_t buyer, const Neighbours& neighbours) const {
    const auto near = neighbours.find(buyer);
    const double mean = average();
    const auto may_sell = [&](const auto& w) {
        const bool next = near == neighbours.end() || near->second.count(w.first) > 0;
        return w.first != self_ && next && w.second.smoothed - mean >= (smoothed() - mean) / 2;
    };
    return 1 + static_cast<int>(std::count_if(workers_.begin(), workers_.end(), may_sell));
}

void Market::put_in(Holdings& holdings, std::size_t number) {
    Holdings::Lot& lot = holdings.lots()[number];
    offer_cost_ += lot.cost;
    for (const std::uint32_t body : lot.bodies) {
        offer_.bodies.push_back(body);
        offer_.cost_s.push_back(static_cast<float>(lot.cost / static_cast<double>(lot.bodies.size())));
    }
    holdings.move(lot, offer_.to);
    lot.cost = -1;
}

void Market::sell(Holdings& holdings, const Neighbours& neighbours) {
    offer_.to = buyer(neighbours);
    if (offer_.to == self_) return;
    const double theirs = workers_.at(offer_.to).smoothed, mean = average();
    const double lot_cost = smoothed() / static_cast<double>(holdings.lots().size());
    const double due = (smoothed() - mean) / sellers(offer_.to, neighbours) + carried_;
    // Then both take as long; or the buyer as long as this one before, if it can pass work on; but no more than the buyer
    // accepts, as answer() has it.
    const double level = 1 + settings_.dead_band,
                 accepted = std::max((level * smoothed() - theirs) / (1 + level), level * mean - theirs);
    double limit =
        std::min(accepted, (smoothed() - theirs) / (!free_ && passes_on(offer_.to, neighbours) ? 1 : 2));
    // What makes the buyer as slow as the average, or one lot; from there on work flows through it.
    if (free_ && theirs < mean) limit = std::min(limit, std::max(mean - theirs + carried_, lot_cost));
    if (free_) limit = std::min(limit, due);
    const double together =
        std::min({lasting_ * mean, smoothed() - mean, (smoothed() - theirs) / 2});  // of several columns
    if (spreads_) limit = std::min(std::max(limit, lot_cost), accepted);
    if (free_ && !spreads_) {
        if (go_.judged_at == 0) go_ = {step_ + kJudgeSteps, kGo * smoothed(), 0, smoothed()};
        limit = std::min(limit, go_.most - go_.sold);
    }
    for (bool more = true; more;) {
        using Order = std::tuple<int, double, double>;
        std::optional<std::pair<Order, std::size_t>> best;
        for (std::size_t i = 0; i < holdings.lots().size(); ++i) {
            const Holdings::Lot& lot = holdings.lots()[i];
            if (lot.cost < kWorthwhile * lot_cost || offer_cost_ + lot.cost > limit * (1 + 1e-9)) continue;
            const Order order{holdings.shortens(lot, offer_.to), -holdings.distance2(lot.column, offer_.to),
                              holdings.distance2(lot.column, self_)};
            if (!best || order > best->first) best = {order, i};
        }
        if (best) put_in(holdings, best->second);
        more = best.has_value();
        if (!free_) limit = together;
    }
    carried_ = free_ ? std::clamp(limit - offer_cost_, 0.0, lot_cost) : 0;
}

void Market::send_home(Holdings& holdings, const Neighbours& neighbours) {
    const auto near = neighbours.find(self_);
    if (near == neighbours.end()) return;
    for (bool more = true; more;) {
        std::optional<std::tuple<int, std::uint32_t, std::size_t>> best;
        for (const std::uint32_t other : near->second) {
            const auto worker = workers_.find(other);
            if (worker == workers_.end() || (!offer_.bodies.empty() && other != offer_.to)) continue;
            const double room = (1 + settings_.dead_band) * average() - worker->second.smoothed;
            for (std::size_t i = 0; i < holdings.lots().size(); ++i) {
                const Holdings::Lot& lot = holdings.lots()[i];
                if (!lot.lies || lot.cost < 0 || offer_cost_ + lot.cost > room) continue;
                const int shortens = holdings.shortens(lot, other);
                if (shortens >= kAmong * static_cast<int>(lot.bodies.size()) &&
                    (!best || shortens > std::get<0>(*best)))
                    best = {shortens, other, i};
            }
        }
        if (best) offer_.to = std::get<1>(*best), put_in(holdings, std::get<2>(*best));
        more = best.has_value();
    }
}

std::optional<Offer> Market::make_offer(Holdings holdings) {
    // Lots' costs are smoothed, too; all together they are what a step takes.
    double sum = 0;
    for (const Holdings::Lot& lot : holdings.lots()) sum += std::max(0.0, lot.cost);
    for (Holdings::Lot& lot : holdings.lots()) lot.cost *= sum > 0 ? smoothed() / sum : 1;
    offer_ = {self_, next_number_, {}, {}, false};
    offer_cost_ = 0;
    const Neighbours neighbours = holdings.neighbours();
    if (wants_less()) {
        sell(holdings, neighbours);
        if (offer_.bodies.empty()) free_ = spreads_ = false, far_steps_ = 0;
    }
    if (offer_.bodies.empty() && turn_ == Turn::home) send_home(holdings, neighbours);
    turn_ = Turn::none;
    if (offer_.bodies.empty()) not_before_ = std::max(not_before_, step_ + kNothingSteps);
    if (offer_.bodies.empty()) return std::nullopt;
    ++next_number_;
    sale_ = Sale::offered, patient_ = true;
    return offer_;
}

std::optional<Offer> Market::make_offer(const Gather& asked) {
    const Worker& self = workers_.at(self_);
    if (asked.to == self_ || !workers_.contains(asked.to) || asked.bodies.empty()) return std::nullopt;
    const double each = self.own > 0 ? self.smoothed / self.own : 0;
    offer_ = {asked.to, next_number_++, asked.bodies,
              std::vector<float>(asked.bodies.size(), static_cast<float>(each)), true};
    offer_cost_ = each * static_cast<double>(asked.bodies.size());
    sale_ = Sale::offered, patient_ = true;
    return offer_;
}

bool Market::answered(std::uint32_t worker, const OfferAnswer& answer) {
    if (sale_ != Sale::offered || worker != offer_.to || answer.number != offer_.number) return false;
    workers_[worker].answers = true;
    sale_ = answer.accepted ? Sale::accepted : Sale::none;
    if (!answer.accepted) carried_ = 0, not_before_ = std::max(not_before_, step_ + kDeclinedSteps);
    return answer.accepted;
}

std::optional<Offer> Market::hand_over() {
    if (sale_ != Sale::accepted || handed_over_) return std::nullopt;
    sale_ = Sale::none;
    go_.sold += offer_cost_, go_.hoped -= offer_cost_;
    handed_over_ = offer_cost_;
    Worker &self = workers_[self_], &buyer = workers_[offer_.to];
    const int bodies = static_cast<int>(offer_.bodies.size());
    credit(self, -bodies, -offer_cost_);
    credit(buyer, bodies, offer_cost_);
    buyer.epoch = std::numeric_limits<std::uint32_t>::max();  // until it is registered
    return offer_;
}

OfferAnswer Market::answer(std::uint32_t seller, const Offer& offer) {
    OfferAnswer answer{seller, offer.number, false};
    const auto found = workers_.find(seller);
    if (found == workers_.end()) return answer;
    const double cost = std::accumulate(offer.cost_s.begin(), offer.cost_s.end(), 0.0);
    double after = smoothed() + cost;
    for (const auto& [from, costs] : promises_) after = std::accumulate(costs.begin(), costs.end(), after);
    answer.accepted =
        offer.gathers ||
        after <= (1 + settings_.dead_band) * std::max(found->second.smoothed - cost, average()) * (1 + 1e-6);
    if (!answer.accepted) return answer;
    // It has one offer at a time: the one before may be handed over, and not be registered here.
    std::deque<double>& promised = promises_[seller];
    promised.push_back(cost);
    if (promised.size() > 2) promised.pop_front();
    return answer;
}

}  // namespace sim
