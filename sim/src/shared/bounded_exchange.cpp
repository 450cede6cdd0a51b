#include "shared/bounded_exchange.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "messages/update_codec.h"

namespace sim {
namespace {

constexpr std::uint64_t kTouchingSteps = 4;

// Steps that workers whose bodies touch may be apart: bodies hold each other up by what was, and the older that is, the less
// steady they stand. Where few touch it matters less than waiting does.
std::uint64_t touching_lead(int bound, int pairs) {
    constexpr int kFewPairs = 8;
    return static_cast<std::uint64_t>(std::clamp(bound / 4, 1, 4)) * (pairs <= kFewPairs ? 2 : 1);
}

// A running mean, by a step's impulse (nullptr: none) with this weight.
void average(StepImpulse& mean, const StepImpulse* now, double weight) {
    const auto pull = [&](auto& to, const auto& from) {
        if (to.size() != from.size()) to.setZero(from.size());
        to += weight * (from - to);
    };
    if (!now) {
        mean.linear *= 1 - weight, mean.angular *= 1 - weight, mean.modal *= 1 - weight;
    } else if (now->linear.allFinite() && now->angular.allFinite() && now->modal.allFinite()) {
        pull(mean.linear, now->linear), pull(mean.angular, now->angular), pull(mean.modal, now->modal);
    }
}

}  // namespace

BoundedExchange::BoundedExchange(const SceneMessage& scene)
    : self_(scene.worker),
      settings_(scene.settings),
      world_(scene.scene.world),
      clock_(scene.scene),
      costs_(clock_.bodies()),
      columns_(scene.scene),
      planned_(scene.scene, columns_.side(),
               structure_outlook(scene.settings.bound, scene.scene.world.settings.dt)),
      foreign_(world_, self_, clock_.bodies(), kept_steps(scene.settings.bound)),
      contacts_(world_, foreign_, self_, {own_, awaits_, owner_}, kept_steps(scene.settings.bound)),
      telling_(static_cast<std::size_t>(clock_.bodies()), scene.settings.bound, scene.scene.world.settings,
               columns_.side()) {
    for (const PointConstraint& c : scene.scene.world.constraints)
        first_of_constraint_.push_back(clock_.moves(c.body_a) || c.body_b < 0 ? c.body_a : c.body_b);
    const auto n = static_cast<std::size_t>(clock_.bodies());
    owner_.assign(n, kApplication), own_.assign(n, 0), told_asleep_.assign(n, 0), since_.assign(n, 0),
        awaits_.assign(n, 0);
    for (std::size_t c = 0; c < scene.scene.world.constraints.size(); ++c)
        if (std::isfinite(scene.scene.world.constraints[c].breaking_force))
            breakable_.push_back(static_cast<std::uint32_t>(c));
    for (int i = 0; i < world_.bodies(); ++i) {
        if (!clock_.moves(i)) continue;
        world_.set_own(i, false);
        foreign_.set(world_.record(i), 0);
    }
    list();
}

void BoundedExchange::list() {
    for (int i = static_cast<int>(flat_.size()); i < world_.bodies(); ++i)
        flat_.push_back(is_flat(world_.definition(i)));
    owned_.clear(), others_.clear();
    for (int i = 0; i < world_.bodies(); ++i) {
        if (!clock_.moves(i)) continue;
        (own_[static_cast<std::size_t>(i)] != 0 ? owned_ : others_).push_back(i);
    }
}

void BoundedExchange::set_own(int body, bool own) {
    own_[static_cast<std::size_t>(body)] = own, awaits_[static_cast<std::size_t>(body)] = 0;
    if (body < world_.bodies()) world_.set_own(body, own);
    felt_.erase(body);
    told_asleep_[static_cast<std::size_t>(body)] = 0;
    telling_.doubt_body(body);
    if (own) costs_.forget(body);
}

// Without own bodies: events up to there, too.
void BoundedExchange::come_to(std::uint64_t step) {
    const int before = world_.bodies();
    clock_.apply(world_, step);
    for (int i = before; i < world_.bodies(); ++i) {
        const bool own = own_[static_cast<std::size_t>(i)] != 0;
        world_.set_own(i, own);
        if (clock_.moves(i) && !own) foreign_.born(world_.record(i), step);
    }
    if (world_.bodies() != before) list();
}

void BoundedExchange::take(const MessageHeader& header, NeighbourMessage&& message) {
    if (!telling_.has(header.worker)) return;  // it is gone
    const std::uint32_t worker = header.worker;
    knows_[worker] = header.epoch;
    std::uint64_t &known = known_[worker], &told = told_[worker];
    if (header.step <= told) return;  // once more, as when this one had just joined
    if (late_ && told == 0) foreign_.nothing_until(worker, header.step - 1);
    told = header.step, known = std::max(known, told);
    if (report_) report_(header, message.smoothed_s, message.own);
    const auto is_its = [&](int body) { return contacts_.owner(body, header.step) == worker; };
    for (const std::uint32_t c : message.broken)
        if (is_its(first_of_constraint_[c])) world_.remove_constraint(static_cast<int>(c));
    std::erase_if(message.crossed, [&](const CrossImpulse& c) { return !is_its(c.own); });
    const auto pairs = std::ranges::count_if(
        message.crossed, [&](const CrossImpulse& c) { return own_[static_cast<std::size_t>(c.ghost)] != 0; });
    if (pairs > 0) touched_[worker] = {std::max(step_, header.step), static_cast<int>(pairs)};
    telling_.heard(worker, header.step, message.reach, header.epoch);
    foreign_.take(worker, header.step, std::move(message), owner_);
    compare(worker, header.step);
}

void BoundedExchange::take(const MessageHeader& header, FoundMessage&& message) {
    const auto purchase = std::ranges::find(purchases_, message.epoch, &Purchase::epoch);
    if (purchase == purchases_.end() || purchase->silent.erase(header.worker) == 0) return;
    for (FoundStep& found : message.steps) {
        std::erase_if(found.crossed, [&](const CrossImpulse& c) {
            return contacts_.owner(c.own, found.step) != header.worker;
        });
        foreign_.add(header.worker, found);
    }
    complete();
}

// Bodies follow with their owners.
void BoundedExchange::take(const MessageHeader& header, const PastMessage& message) {
    late_ = true;
    for (const PastSale& sale : message.sales) contacts_.sold(sale);
    for (const std::uint32_t c : message.broken) world_.remove_constraint(static_cast<int>(c));
    come_to(header.step);
}

int BoundedExchange::lead() const {
    const std::uint64_t least = slowest();
    return least < step_ ? static_cast<int>(step_ - least) : 0;
}

bool BoundedExchange::ready() const {
    if (owned_.empty() || owners_follow_) return false;
    if (at_end()) return !settled_ && may_give();
    if (lead() > settings_.bound || is_waited_for()) return false;
    return std::all_of(touched_.begin(), touched_.end(), [&](const auto& t) {
        const auto& [worker, touch] = t;
        return touch.step + kTouchingSteps < step_ || !owns_any(worker) ||
               known(worker) + touching_lead(settings_.bound, touch.pairs) >= step_;
    });
}

void BoundedExchange::place_ghosts() {
    balls_.clear();
    for (const int body : others_)
        if (foreign_.known(body) && !foreign_.quarantined(body) && is_told(body))
            balls_.push_back(foreign_.ball(body, step_));
    world_.near_own(balls_, near_);
    ghost_age_ = 0;
    for (const int body : near_) {
        const ForeignBodies::Ghost& ghost = foreign_.at(body, step_);
        if (!world_.is_near_own(body, ghost.state)) continue;
        ghost_age_ = std::max(ghost_age_, ghost.age);
        world_.place_ghost(body, ghost.state, ghost.held.is_zero() ? nullptr : &ghost.held, ghost.asleep);
    }
}

// Impulses between own bodies and ghosts, as they travel: own bodies get what is lost by rounding.
void BoundedExchange::keep_crossed() {
    crossed_.clear();
    for (CrossImpulse c : world_.cross_impulses()) {
        if (!c.linear.allFinite() || !c.angular_own.allFinite() || !c.angular_ghost.allFinite())
            continue;  // of a body that is broken
        const Eigen::Vector3d linear = as_sent(c.linear), angular = angular_as_sent(c.angular_own);
        world_.kick(c.own, linear - c.linear, angular - c.angular_own);
        c.linear = linear, c.angular_own = angular;
        c.angular_ghost = angular_as_sent(c.angular_ghost);
        felt_[c.own].touched = step_;
        crossed_.push_back(c);
    }
    std::ranges::sort(crossed_, {}, [](const CrossImpulse& c) { return std::pair(c.own, c.ghost); });
    const auto touches = [this](const CrossImpulse& c) -> Touch& {
        return touched_[owner_[static_cast<std::size_t>(c.ghost)]];
    };
    for (const CrossImpulse& c : crossed_) touches(c) = {step_, 0};
    for (const CrossImpulse& c : crossed_) ++touches(c).pairs;
    touched_.erase(self_);  // what was bought is not own before its step
    foreign_.keep_own(step_, crossed_);
    for (const auto& [worker, known] : known_)
        if (known >= step_) compare(worker, step_);
}

// What holds bodies that touch others': those who have them as ghosts want to know.
void BoundedExchange::feel() {
    for (auto entry = felt_.begin(); entry != felt_.end();) {
        auto& [body, felt] = *entry;
        const bool touches =
            felt.touched + kTouchingSteps >= step_ && own_[static_cast<std::size_t>(body)] != 0;
        if (felt.watched) {
            const StepImpulse* now = world_.impulse(body);
            if (now) felt.held = step_;
            felt.steps = std::min(felt.steps + 1, kHeldSteps);
            average(felt.mean, now, 1.0 / felt.steps);
            if (felt.held + kTouchingSteps < step_) felt.mean.set_zero(), felt.steps = 0;  // it is free
        }
        felt.watched = touches;
        world_.watch(body, touches);
        entry = touches ? std::next(entry) : felt_.erase(entry);
    }
}

void BoundedExchange::step() {
    if (at_end()) {
        settled_ = published_ == step_;  // else, having come here by taking bodies over, it says so first
        return;
    }
    come_to(step_);
    place_ghosts();
    std::vector<std::uint32_t> breakable;
    for (const std::uint32_t c : breakable_)
        if (world_.constraint_holds(static_cast<int>(c))) breakable.push_back(c);
    world_.step();
    ++step_;
    for (const std::uint32_t c : breakable)
        if (!world_.constraint_holds(static_cast<int>(c))) broken_.push_back(c);
    keep_crossed();
    feel();
    take_due();
}

// What the application knows to sleep is not in the message to it.
void BoundedExchange::pack(std::size_t which) {
    Packed& own = seen_[which];
    if (own.at >= 0) return;
    own.at = static_cast<std::int32_t>(packed_.places().size());
    if (own.update < 0) tell(own.body, update_);
    packed_.add(own.update < 0
                    ? update_
                    : std::get<UpdateMessage>(outgoing_).bodies[static_cast<std::size_t>(own.update)]);
}

void BoundedExchange::tell(int body, Update& update) {
    world_.record(body, record_);
    update.body = static_cast<std::uint32_t>(body);
    update.asleep = record_.asleep, update.quarantined = record_.quarantined;
    update.still = is_still(record_, world_.settings().dt);
    std::swap(update.state, record_.state);
    const auto felt = felt_.find(body);
    if (felt != felt_.end()) update.impulse = felt->second.mean;
    update.held = felt != felt_.end() && !update.impulse.is_zero();
}

// After the last step: exact states that what came late has put right. Nobody hears of them but the application.
void BoundedExchange::publish_last(const StepReport& report) const {
    StateMessage message;
    message.report = report;
    for (const int body : owned_) message.bodies.push_back(world_.record(body));
    send(message);
}

void BoundedExchange::publish(std::uint32_t epoch, const StepReport& report) {
    epoch_ = epoch;
    if (settled_) return publish_last(report);
    auto& message = std::get<UpdateMessage>(outgoing_);
    message.report = report;
    packed_.clear(), seen_.clear();
    telling_.begin();
    std::size_t count = 0;
    for (const int body : owned_) {
        std::uint8_t& told = told_asleep_[static_cast<std::size_t>(body)];
        const bool asleep = world_.asleep(body);
        seen_.push_back({body});
        if (asleep && told != 0) {
            see(body, world_.state(body), asleep);
            continue;
        }
        told = asleep;
        if (count == message.bodies.size()) message.bodies.emplace_back();
        Update& update = message.bodies[count];
        tell(body, update);
        see(body, update.state, asleep);
        seen_.back().update = static_cast<std::int32_t>(count++);
    }
    message.bodies.resize(count);
    tell_neighbours(report);
    crossed_.clear();
    message.broken.swap(broken_), broken_.clear();
    published_ = step_;
    send(outgoing_);
}

void BoundedExchange::see(int body, const WorldBodyState& state, bool asleep) {
    telling_.see(body, state, world_.radius_now(body), asleep, flat_[static_cast<std::size_t>(body)] != 0);
}

void BoundedExchange::see_own() {
    packed_.clear(), seen_.clear();
    telling_.begin();
    for (const int body : owned_) {
        seen_.push_back({body});
        see(body, world_.state(body), world_.asleep(body));
    }
}

void BoundedExchange::tell_neighbours(const StepReport& report) {
    auto& message = std::get<NeighbourMessage>(to_neighbour_);
    message.smoothed_s = report.smoothed_s, message.own = report.own;
    message.reach = telling_.reach(coming()), message.broken = broken_;
    message.places.clear();
    for (const int body : owned_)
        if (const Eigen::Vector3f place = world_.state(body).position.cast<float>();
            step_ % kPlacesEvery == 0 && place.allFinite())
            message.places.push_back({static_cast<std::uint32_t>(body), place});
    telling_.each([this](std::uint32_t worker) { tell(worker); });
}

void BoundedExchange::tell(std::uint32_t worker) {
    auto& message = std::get<NeighbourMessage>(to_neighbour_);
    message.to = worker, message.heard = told(worker);
    message.bodies.clear();
    for (const std::size_t which : telling_.choose(worker, step_)) {
        pack(which);
        message.bodies.add(packed_, packed_.places()[static_cast<std::size_t>(seen_[which].at)]);
    }
    message.crossed.clear();
    std::ranges::copy_if(crossed_, std::back_inserter(message.crossed), [&](const CrossImpulse& c) {
        return owner_[static_cast<std::size_t>(c.ghost)] == worker;
    });
    send(to_neighbour_);
}

// Else it is far away by now.
bool BoundedExchange::is_told(int body) const {
    const auto at = static_cast<std::size_t>(body);
    const std::uint32_t owner = owner_[at];
    return owner == kApplication || owner == self_ || foreign_.asleep(body) || epoch_of(owner) < since_[at] ||
           foreign_.newest(body) >= std::min(told(owner), step_);
}

Holdings BoundedExchange::holdings() {
    const auto place = [this](int body) {
        const bool told = !world_.own(body) && foreign_.known(body);
        return told ? foreign_.last_position(body) : world_.state(body).position;
    };
    std::vector<OthersBody> others;
    for (const int body : others_) {
        if (flat_[static_cast<std::size_t>(body)] == 0 || !foreign_.known(body) || !is_told(body)) continue;
        const ForeignBodies::Ghost& ghost = foreign_.at(body, step_);
        others.push_back({body, ghost.asleep, ghost.state});
    }
    std::vector<std::vector<int>> whole = structures(world_, owned_, columns_.side());
    for (std::vector<int>& flat :
         flat_structures(world_, owned_, columns_.side(),
                         structure_outlook(settings_.bound, world_.settings().dt), others))
        whole.push_back(std::move(flat));
    planned_.add_unfinished(world_.bodies(), whole);
    return columns_.holdings(self_, world_, owner_, costs_, place, whole);
}

}  // namespace sim
