#include "shared/market.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <set>
#include <tuple>
#include <utility>

namespace sim {
namespace {

// A worker is far above the average of the others by this share of it and this many bodies' cost. It sells
// out of turn after so many such steps in a row, until it is near the average. Bodies that meet cost more,
// and a processor may be unsteady; both pass. A processor that became slower stays so.
constexpr double kFar = 0.5, kFarBodies = 1.5;
constexpr int kFarSteps = 10;
constexpr double kNear = 0.03;  // share of the average of all
// From turn to turn. A sale is registered within some five steps of the first step of its turn. So two sales
// are twenty steps apart or more.
constexpr int kTurnSteps = 25;
constexpr std::uint64_t kHomingTurns = 4;  // one of so many turns, at least, is for columns that are returned
constexpr int kAmong =
    3;  // a column lies among another worker's if the border becomes shorter by so much per body
constexpr std::uint64_t kDeclinedSteps = 3, kNothingSteps = 5;  // to the next offer
// At most this share of own work is sold before it shows whether that helps. What a body costs may lie in the
// bodies that it touches, and stay here.
constexpr double kTrial = 0.3, kTrialLeast = 0.05;
constexpr std::uint64_t kJudgeSteps = 10, kPatience = 80;
constexpr double kWorthwhile = 0.25;  // a lot that costs less than this share of the mean lot is not sold

}  // namespace

Market::Market(std::uint32_t self, const MarketSettings& settings, int bound)
    : self_(self),
      settings_(settings),
      turn_steps_(static_cast<std::uint64_t>(std::max(kTurnSteps, bound + 1))),
      patience_(kPatience) {
    workers_[self];
}

void Market::set_members(const std::vector<std::uint32_t>& workers) {
    const auto is_member = [&workers](std::uint32_t worker) {
        return std::find(workers.begin(), workers.end(), worker) != workers.end();
    };
    std::erase_if(workers_, [&](const auto& w) { return w.first != self_ && !is_member(w.first); });
    std::erase_if(promises_, [&](const auto& p) { return !is_member(p.first); });
    for (const std::uint32_t worker : workers)
        if (const auto [entry, is_new] = workers_.try_emplace(worker); is_new)
            entry->second.answers = step_ == 0;
    // Bodies that were handed over are registered in any case: for the buyer, or for this worker again.
    if (!is_member(offer_.to)) sale_ = Sale::none;
}

void Market::receive_report(const MessageHeader& header, double smoothed_s, std::uint32_t own) {
    const auto found = workers_.find(header.worker);
    if (found == workers_.end() || header.worker == self_) return;
    found->second.answers = true;
    mark(found->second, header.step, smoothed_s);
    if (header.epoch < found->second.epoch) return;
    found->second.smoothed = smoothed_s;
    found->second.own = static_cast<int>(own);
}

void Market::add_load(Worker& worker, int bodies, double cost) {
    worker.own = std::max(0, worker.own + bodies);
    const double before = worker.smoothed;
    worker.smoothed = worker.own == 0 ? 0 : std::max(0.0, worker.smoothed + cost);
    if (&worker == &workers_[self_] && before > 0) work_ *= worker.smoothed / before;
}

void Market::register_sale(std::uint32_t epoch, const Ownership& ownership) {
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
        if (ownership.from != self_) add_load(from->second, -bodies, -cost);
    }
    if (to != workers_.end()) {
        to->second.epoch = epoch;
        if (!own_sale || ownership.owner == self_) add_load(to->second, bodies, cost);
    }
    if (ownership.owner == self_) trial_.expected += cost;
}

void Market::end_step(std::uint64_t step, double seconds, double work, int own) {
    Worker& self = workers_[self_];
    if (step <= step_) {  // the last step, which is published again: its time is not that of a step
        if (step == step_) mark(self, step, static_cast<float>(self.smoothed));
        return;
    }
    step_ = step;
    self.own = own;
    work = std::max(work, 1.0);  // sleeping bodies cost something, too
    if (own == 0) {
        steps_known_ = self.smoothed = work_ = 0;
    } else if (steps_known_ == 0) {
        // The seller's costs of bodies that were bought count as if they were known from some steps.
        const bool known = self.smoothed > 0;
        many_seconds_ = known ? self.smoothed : seconds;
        work_ = many_work_ = work;
        steps_known_ = known ? settings_.smoothing_steps / 4 : 1;
    } else {
        steps_known_ = std::min(steps_known_ + 1, settings_.smoothing_steps);
        many_seconds_ += (seconds - many_seconds_) / steps_known_;
        many_work_ += (work - many_work_) / steps_known_;
        work_ += (work - work_) / std::min(steps_known_, BodyCosts::kSmoothing);
    }
    if (own > 0) self.smoothed = work_ * many_seconds_ / many_work_;
    mark(self, step_, static_cast<float>(self.smoothed));  // as the others receive it
    watch_level();
    begin_turn();
}

double Market::average() const {
    const double sum = std::accumulate(workers_.begin(), workers_.end(), 0.0,
                                       [](double s, const auto& w) { return s + w.second.smoothed; });
    return sum / static_cast<double>(workers_.size());
}

bool Market::is_above(const Worker& worker) const {
    return worker.smoothed > (1 + settings_.dead_band) * average();
}

void Market::mark(Worker& worker, std::uint64_t step, double smoothed) const {
    if (step % turn_steps_ == 0) worker.marks[step / turn_steps_ % worker.marks.size()] = {step, smoothed};
}

// Finds out whose turn it is by all reports of the step in which the turn before began, so that all workers
// agree. Several columns are sold only by a worker that was above the average in the turn before that, too.
void Market::begin_turn() {
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
            if (then.step != step_ - before * turn_steps_) continue;  // it owned nothing
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
    if (!sellers.empty() && turn % kHomingTurns != 0) {
        const std::size_t others = sellers.size() - 1;
        const std::size_t place = turn % 2 == 1 || others == 0 ? 0 : 1 + turn / kHomingTurns % others;
        if (sellers[place].second == self_) turn_ = Turn::sale;
    } else if (all[(sellers.empty() ? turn : turn / kHomingTurns) % all.size()] == self_) {
        turn_ = Turn::homing;
    }
}

// A trial helped unless own time has risen again by more than half of what was sold, as far as smoothing
// shows that.
void Market::judge_trial() {
    if (trial_.judged_at == 0 || step_ < trial_.judged_at) return;
    const double shown = 1 - std::exp(-static_cast<double>(kJudgeSteps) / settings_.smoothing_steps);
    const bool helped =
        trial_.sold < kTrialLeast * smoothed() || smoothed() - trial_.expected < 0.5 * shown * trial_.sold;
    if (!helped) not_before_ = step_ + patience_;
    patience_ = helped ? kPatience : 4 * patience_;
    trial_ = {};
}

void Market::watch_level() {
    judge_trial();
    const Worker& self = workers_.at(self_);
    const bool idle =
        std::any_of(workers_.begin(), workers_.end(), [](const auto& w) { return w.second.own == 0; });
    const auto others = std::max(1.0, static_cast<double>(workers_.size()) - 1);
    const double theirs = (average() * static_cast<double>(workers_.size()) - self.smoothed) / others;
    const double body = self.own > 0 ? self.smoothed / self.own : 0;
    const bool far = self.smoothed - theirs > std::max(kFar * theirs, kFarBodies * body);
    far_steps_ = far ? far_steps_ + 1 : 0;
    if (self.smoothed <= (1 + kNear) * average()) free_ = fills_idle_ = false;
    if (far && idle) fills_idle_ = true;
    if (far_steps_ >= kFarSteps || fills_idle_) free_ = true;
}

bool Market::wants_less() const {
    if (fills_idle_) return true;
    if (steps_known_ < settings_.smoothing_steps / 2) return false;
    return free_ || (turn_ == Turn::sale && is_above(workers_.at(self_)));
}

bool Market::wants_to_sell() const {
    return settings_.trade && step_ >= settings_.from_step && step_ >= not_before_ && sale_ == Sale::none &&
           workers_.size() > 1 && steps_known_ > 0 && (wants_less() || turn_ == Turn::homing);
}

// The fastest neighbour; this worker itself if none is faster.
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

bool Market::has_faster_neighbour(std::uint32_t worker, const Neighbours& neighbours) const {
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

void Market::add_to_offer(Holdings& holdings, std::size_t number) {
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
    // Half of the difference makes both take as long. If the buyer can pass work on, all of the difference is
    // sold. The buyer accepts no more than answer() says.
    const double level = 1 + settings_.dead_band,
                 accepted = std::max((level * smoothed() - theirs) / (1 + level), level * mean - theirs);
    double limit = std::min(
        accepted, (smoothed() - theirs) / (!free_ && has_faster_neighbour(offer_.to, neighbours) ? 1 : 2));
    // Out of turn the buyer becomes as slow as the average, or gets one lot. Further work flows through it to
    // others.
    if (free_ && theirs < mean) limit = std::min(limit, std::max(mean - theirs + carried_, lot_cost));
    if (free_) limit = std::min(limit, due);
    const double together =
        std::min({lasting_ * mean, smoothed() - mean, (smoothed() - theirs) / 2});  // for several columns
    if (fills_idle_) limit = std::min(std::max(limit, lot_cost), accepted);
    if (free_ && !fills_idle_) {
        if (trial_.judged_at == 0) trial_ = {step_ + kJudgeSteps, kTrial * smoothed(), 0, smoothed()};
        limit = std::min(limit, trial_.most - trial_.sold);
    }
    for (bool more = true; more;) {
        using Order = std::tuple<int, double, double>;
        std::optional<std::pair<Order, std::size_t>> best;
        for (std::size_t i = 0; i < holdings.lots().size(); ++i) {
            const Holdings::Lot& lot = holdings.lots()[i];
            if (lot.cost < kWorthwhile * lot_cost || offer_cost_ + lot.cost > limit * (1 + 1e-9)) continue;
            const Order order{holdings.border_saved(lot, offer_.to),
                              -holdings.distance2(lot.column, offer_.to),
                              holdings.distance2(lot.column, self_)};
            if (!best || order > best->first) best = {order, i};
        }
        if (best) add_to_offer(holdings, best->second);
        more = best.has_value();
        if (!free_) limit = together;
    }
    carried_ = free_ ? std::clamp(limit - offer_cost_, 0.0, lot_cost) : 0;
}

void Market::return_settled(Holdings& holdings, const Neighbours& neighbours) {
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
                if (!lot.settled || lot.cost < 0 || offer_cost_ + lot.cost > room) continue;
                const int saved = holdings.border_saved(lot, other);
                if (saved >= kAmong * static_cast<int>(lot.bodies.size()) &&
                    (!best || saved > std::get<0>(*best)))
                    best = {saved, other, i};
            }
        }
        if (best) offer_.to = std::get<1>(*best), add_to_offer(holdings, std::get<2>(*best));
        more = best.has_value();
    }
}

std::optional<Offer> Market::make_offer(Holdings holdings) {
    // Scales the smoothed costs of lots so that their sum is the time of a step.
    double sum = 0;
    for (const Holdings::Lot& lot : holdings.lots()) sum += std::max(0.0, lot.cost);
    for (Holdings::Lot& lot : holdings.lots()) lot.cost *= sum > 0 ? smoothed() / sum : 1;
    offer_ = {self_, next_number_, {}, {}, false};
    offer_cost_ = 0;
    const Neighbours neighbours = holdings.neighbours();
    if (wants_less()) {
        sell(holdings, neighbours);
        if (offer_.bodies.empty()) free_ = fills_idle_ = false, far_steps_ = 0;
    }
    if (offer_.bodies.empty() && turn_ == Turn::homing) return_settled(holdings, neighbours);
    turn_ = Turn::none;
    if (offer_.bodies.empty()) not_before_ = std::max(not_before_, step_ + kNothingSteps);
    if (offer_.bodies.empty()) return std::nullopt;
    ++next_number_;
    sale_ = Sale::offered, patient_ = true;
    return offer_;
}

std::optional<Offer> Market::make_offer(const Gather& request) {
    const Worker& self = workers_.at(self_);
    if (request.to == self_ || !workers_.contains(request.to) || request.bodies.empty()) return std::nullopt;
    const double each = self.own > 0 ? self.smoothed / self.own : 0;
    offer_ = {request.to, next_number_++, request.bodies,
              std::vector<float>(request.bodies.size(), static_cast<float>(each)), true};
    offer_cost_ = each * static_cast<double>(request.bodies.size());
    sale_ = Sale::offered, patient_ = true;
    return offer_;
}

bool Market::receive_answer(std::uint32_t worker, const OfferAnswer& answer) {
    if (sale_ != Sale::offered || worker != offer_.to || answer.number != offer_.number) return false;
    workers_[worker].answers = true;
    sale_ = answer.accepted ? Sale::accepted : Sale::none;
    if (!answer.accepted) carried_ = 0, not_before_ = std::max(not_before_, step_ + kDeclinedSteps);
    return answer.accepted;
}

std::optional<Offer> Market::hand_over() {
    if (sale_ != Sale::accepted || handed_over_) return std::nullopt;
    sale_ = Sale::none;
    trial_.sold += offer_cost_, trial_.expected -= offer_cost_;
    handed_over_ = offer_cost_;
    Worker &self = workers_[self_], &buyer = workers_[offer_.to];
    const int bodies = static_cast<int>(offer_.bodies.size());
    add_load(self, -bodies, -offer_cost_);
    add_load(buyer, bodies, offer_cost_);
    buyer.epoch =
        std::numeric_limits<std::uint32_t>::max();  // its reports do not count until the registration
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
    // A seller has one offer at a time. The one before may be handed over and not be registered here yet.
    std::deque<double>& promised = promises_[seller];
    promised.push_back(cost);
    if (promised.size() > 2) promised.pop_front();
    return answer;
}

}  // namespace sim
