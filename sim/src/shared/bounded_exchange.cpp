#include "shared/bounded_exchange.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "messages/update_codec.h"

namespace sim {
namespace {

constexpr std::uint64_t kTouchingSteps =
    4;  // for so long after their last contact two bodies count as touching

// Steps that workers whose bodies touch may be apart. Their bodies hold each other up by past states; the
// older these are, the less steady the bodies stand. Where few bodies touch, this matters less than waiting
// does.
std::uint64_t touching_lead(int bound, int pairs) {
    constexpr int kFewPairs = 8;
    return static_cast<std::uint64_t>(std::clamp(bound / 4, 1, 4)) * (pairs <= kFewPairs ? 2 : 1);
}

// Moves a mean towards a step's impulse (nullptr: none), by this weight.
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
      structures_(scene.scene, columns_.side(),
                  structure_outlook(scene.settings.bound, scene.scene.world.settings.dt)),
      foreign_(world_, self_, clock_.bodies(), kept_steps(scene.settings.bound)),
      contacts_(world_, foreign_, self_, {own_, waiting_, owner_}, kept_steps(scene.settings.bound)),
      border_(static_cast<std::size_t>(clock_.bodies()), scene.settings.bound, scene.scene.world.settings,
              columns_.side()) {
    const auto n = static_cast<std::size_t>(clock_.bodies());
    owner_.assign(n, kApplication), own_.assign(n, 0), sent_asleep_.assign(n, 0), since_.assign(n, 0),
        waiting_.assign(n, 0);
    const std::vector<PointConstraint>& constraints = scene.scene.world.constraints;
    for (std::size_t i = 0; i < constraints.size(); ++i) {
        const PointConstraint& c = constraints[i];
        first_of_constraint_.push_back(clock_.moves(c.body_a) || c.body_b < 0 ? c.body_a : c.body_b);
        if (std::isfinite(c.breaking_force)) breakable_.push_back(static_cast<std::uint32_t>(i));
    }
    for (int i = 0; i < world_.bodies(); ++i) {
        if (!clock_.moves(i)) continue;
        world_.set_own(i, false);
        foreign_.set(world_.record(i), 0);
    }
    list_bodies();
}

void BoundedExchange::list_bodies() {
    for (int i = static_cast<int>(flat_.size()); i < world_.bodies(); ++i)
        flat_.push_back(is_flat(world_.definition(i)));
    owned_.clear(), others_.clear();
    for (int i = 0; i < world_.bodies(); ++i)
        if (clock_.moves(i)) (own_[static_cast<std::size_t>(i)] != 0 ? owned_ : others_).push_back(i);
}

void BoundedExchange::set_own(int body, bool own) {
    const auto at = static_cast<std::size_t>(body);
    own_[at] = own, waiting_[at] = 0, sent_asleep_[at] = 0;
    if (body < world_.bodies()) world_.set_own(body, own);
    contact_history_.erase(body);
    border_.invalidate(body);
    if (own) costs_.forget(body);
}

// Applies the events before the step after `step`.
void BoundedExchange::apply_events(std::uint64_t step) {
    const int before = world_.bodies();
    clock_.apply(world_, step);
    for (int i = before; i < world_.bodies(); ++i) {
        const bool own = own_[static_cast<std::size_t>(i)] != 0;
        world_.set_own(i, own);
        if (clock_.moves(i) && !own) foreign_.add_body(world_.record(i), step);
    }
    if (world_.bodies() != before) list_bodies();
}

void BoundedExchange::receive(const MessageHeader& header, NeighbourMessage&& message) {
    const std::uint32_t worker = header.worker;
    if (!border_.has(worker)) return;  // it has left
    Peer& peer = peers_[worker];
    peer.message_epoch = header.epoch;
    if (header.step <= peer.message_step) return;  // sent again because this worker had just joined
    if (late_ && peer.message_step == 0) foreign_.expect_nothing_until(worker, header.step - 1);
    peer.message_step = header.step, peer.steps = std::max(peer.steps, header.step);
    if (report_) report_(header, message.smoothed_s, message.own);
    const auto is_its = [&](int body) { return contacts_.owner(body, header.step) == worker; };
    for (const std::uint32_t c : message.broken)
        if (is_its(first_of_constraint_[c])) world_.remove_constraint(static_cast<int>(c));
    std::erase_if(message.crossed, [&](const CrossImpulse& c) { return !is_its(c.own); });
    const auto pairs = std::ranges::count_if(
        message.crossed, [&](const CrossImpulse& c) { return own_[static_cast<std::size_t>(c.ghost)] != 0; });
    if (pairs > 0) touched_[worker] = {std::max(step_, header.step), static_cast<int>(pairs)};
    border_.set_reach(worker, header.step, message.reach, header.epoch);
    foreign_.receive(worker, header.step, std::move(message), owner_);
    compare(worker, header.step);
}

void BoundedExchange::receive(const MessageHeader& header, FoundMessage&& message) {
    const auto purchase = std::ranges::find(purchases_, message.epoch, &Purchase::epoch);
    if (purchase == purchases_.end() || purchase->waiting_for.erase(header.worker) == 0) return;
    for (FoundStep& found : message.steps) {
        std::erase_if(found.crossed, [&](const CrossImpulse& c) {
            return contacts_.owner(c.own, found.step) != header.worker;
        });
        foreign_.add_found(header.worker, found);
    }
    finish_purchases();
}

// The states of bodies follow with their owners.
void BoundedExchange::receive(const MessageHeader& header, const PastMessage& message) {
    late_ = true;
    for (const PastSale& sale : message.sales) contacts_.add_sale(sale);
    for (const std::uint32_t c : message.broken) world_.remove_constraint(static_cast<int>(c));
    apply_events(header.step);
}

int BoundedExchange::lead() const {
    const std::uint64_t least = least_steps();
    return least < step_ ? static_cast<int>(step_ - least) : 0;
}

bool BoundedExchange::ready() const {
    if (owned_.empty() || owners_follow_) return false;
    if (at_end()) return !settled_ && may_hand_over();
    if (lead() > settings_.bound || comparison_is_overdue()) return false;
    return std::all_of(touched_.begin(), touched_.end(), [&](const auto& t) {
        const auto& [worker, touch] = t;
        return touch.step + kTouchingSteps < step_ || !owns_bodies(worker) ||
               steps_of(worker) + touching_lead(settings_.bound, touch.pairs) >= step_;
    });
}

void BoundedExchange::place_ghosts() {
    balls_.clear();
    for (const int body : others_)
        if (foreign_.known(body) && !foreign_.quarantined(body) && is_current(body))
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

// Keeps the impulses between own bodies and ghosts as they are sent. Own bodies get what rounding takes from
// them.
void BoundedExchange::record_cross_impulses() {
    crossed_.clear();
    for (CrossImpulse c : world_.cross_impulses()) {
        if (!c.linear.allFinite() || !c.angular_own.allFinite() || !c.angular_ghost.allFinite())
            continue;  // of a broken body
        const Eigen::Vector3d linear = as_sent(c.linear), angular = angular_as_sent(c.angular_own);
        world_.kick(c.own, linear - c.linear, angular - c.angular_own);
        c.linear = linear, c.angular_own = angular;
        c.angular_ghost = angular_as_sent(c.angular_ghost);
        contact_history_[c.own].cross_contact = step_;
        crossed_.push_back(c);
    }
    std::ranges::sort(crossed_, {}, bodies_of);
    const auto touch_of = [this](const CrossImpulse& c) -> Touch& {
        return touched_[owner_[static_cast<std::size_t>(c.ghost)]];
    };
    for (const CrossImpulse& c : crossed_) touch_of(c) = {step_, 0};
    for (const CrossImpulse& c : crossed_) ++touch_of(c).pairs;
    touched_.erase(self_);  // a body that was bought is a ghost up to the step of its sale
    foreign_.keep_own(step_, crossed_);
    for (const auto& [worker, peer] : peers_)
        if (peer.steps >= step_) compare(worker, step_);
}

// Averages the impulses that hold own bodies which touch others' bodies: the others need them for their
// ghosts.
void BoundedExchange::update_contact_histories() {
    for (auto entry = contact_history_.begin(); entry != contact_history_.end();) {
        auto& [body, history] = *entry;
        const bool touches =
            history.cross_contact + kTouchingSteps >= step_ && own_[static_cast<std::size_t>(body)] != 0;
        if (history.watched) {
            const StepImpulse* now = world_.impulse(body);
            if (now) history.held = step_;
            history.steps = std::min(history.steps + 1, kHeldSteps);
            average(history.mean, now, 1.0 / history.steps);
            if (history.held + kTouchingSteps < step_)  // nothing holds it any more
                history.mean.set_zero(), history.steps = 0;
        }
        history.watched = touches;
        world_.watch(body, touches);
        entry = touches ? std::next(entry) : contact_history_.erase(entry);
    }
}

void BoundedExchange::step() {
    if (at_end()) {
        settled_ =
            published_ == step_;  // else bodies were taken over in the last step, which is published first
        return;
    }
    apply_events(step_);
    place_ghosts();
    std::vector<std::uint32_t> breakable;
    for (const std::uint32_t c : breakable_)
        if (world_.constraint_holds(static_cast<int>(c))) breakable.push_back(c);
    world_.step();
    ++step_;
    for (const std::uint32_t c : breakable)
        if (!world_.constraint_holds(static_cast<int>(c))) broken_.push_back(c);
    record_cross_impulses();
    update_contact_histories();
    take_over_due();
}

void BoundedExchange::publish(std::uint32_t epoch, const StepReport& report) {
    epoch_ = epoch;
    if (settled_) return publish_last(report);
    auto& message = std::get<UpdateMessage>(to_application_);
    message.report = report;
    std::size_t count = 0;
    collect_own();
    for (OwnBody& own : own_bodies_) {
        std::uint8_t& sent_asleep = sent_asleep_[static_cast<std::size_t>(own.body)];
        const bool asleep = world_.asleep(own.body);
        if (asleep && sent_asleep != 0) continue;
        sent_asleep = asleep;
        if (count == message.bodies.size()) message.bodies.emplace_back();
        fill_update(own.body, message.bodies[count]);
        own.update = static_cast<std::int32_t>(count++);
    }
    message.bodies.resize(count);
    send_borders(report);
    crossed_.clear();
    message.broken.swap(broken_), broken_.clear();
    published_ = step_;
    send(to_application_);
}

// Sends the exact states after the last step, with all corrections, to the application alone.
void BoundedExchange::publish_last(const StepReport& report) const {
    StateMessage message;
    message.report = report;
    for (const int body : owned_) message.bodies.push_back(world_.record(body));
    send(message);
}

void BoundedExchange::collect_own() {
    packed_.clear(), own_bodies_.clear();
    border_.begin_step();
    for (const int body : owned_) {
        own_bodies_.push_back({body});
        border_.add_own(body, world_.state(body), world_.radius_now(body), world_.asleep(body),
                        flat_[static_cast<std::size_t>(body)] != 0);
    }
}

void BoundedExchange::fill_update(int body, Update& update) {
    world_.record(body, record_);
    update.body = static_cast<std::uint32_t>(body);
    update.asleep = record_.asleep, update.quarantined = record_.quarantined;
    update.still = is_still(record_, world_.settings().dt);
    std::swap(update.state, record_.state);
    const auto history = contact_history_.find(body);
    if (history != contact_history_.end()) update.impulse = history->second.mean;
    update.held = history != contact_history_.end() && !update.impulse.is_zero();
}

// Encodes the state of an own body for all neighbours. A body that the application knows to sleep is not in
// its message.
void BoundedExchange::pack(OwnBody& own) {
    if (own.packed >= 0) return;
    own.packed = static_cast<std::int32_t>(packed_.places().size());
    if (own.update < 0) fill_update(own.body, update_);
    packed_.add(own.update < 0
                    ? update_
                    : std::get<UpdateMessage>(to_application_).bodies[static_cast<std::size_t>(own.update)]);
}

void BoundedExchange::send_borders(const StepReport& report) {
    auto& message = std::get<NeighbourMessage>(to_neighbour_);
    message.smoothed_s = report.smoothed_s, message.own = report.own;
    message.reach = border_.reach(future_bodies()), message.broken = broken_;
    message.places.clear();
    for (const int body : owned_)
        if (const Eigen::Vector3f place = world_.state(body).position.cast<float>();
            step_ % kPlacesEvery == 0 && place.allFinite())
            message.places.push_back({static_cast<std::uint32_t>(body), place});
    border_.for_each([this](std::uint32_t worker) { send_border(worker); });
}

void BoundedExchange::send_border(std::uint32_t worker) {
    auto& message = std::get<NeighbourMessage>(to_neighbour_);
    message.to = worker, message.acknowledged = peer(worker).message_step;
    message.bodies.clear();
    for (const std::size_t which : border_.select(worker, step_)) {
        OwnBody& own = own_bodies_[which];
        pack(own);
        message.bodies.add(packed_, packed_.places()[static_cast<std::size_t>(own.packed)]);
    }
    message.crossed.clear();
    std::ranges::copy_if(crossed_, std::back_inserter(message.crossed), [&](const CrossImpulse& c) {
        return owner_[static_cast<std::size_t>(c.ghost)] == worker;
    });
    send(to_neighbour_);
}

// Whether the latest state of another's body is as new as its owner's last message. If not, the owner did not
// send the body, so it is far away.
bool BoundedExchange::is_current(int body) const {
    const auto at = static_cast<std::size_t>(body);
    const std::uint32_t owner = owner_[at];
    if (owner == kApplication || owner == self_ || foreign_.asleep(body)) return true;
    const Peer its_owner = peer(owner);
    return its_owner.message_epoch < since_[at] ||
           foreign_.latest_step(body) >= std::min(its_owner.message_step, step_);
}

Holdings BoundedExchange::holdings() {
    const auto place = [this](int body) {
        return !world_.own(body) && foreign_.known(body) ? foreign_.latest_position(body)
                                                         : world_.state(body).position;
    };
    std::vector<OthersBody> others;
    for (const int body : others_) {
        if (flat_[static_cast<std::size_t>(body)] == 0 || !foreign_.known(body) || !is_current(body))
            continue;
        const ForeignBodies::Ghost& ghost = foreign_.at(body, step_);
        others.push_back({body, ghost.asleep, ghost.state});
    }
    return columns_.holdings(self_, world_, owner_, costs_, place, structures_.all(world_, owned_, others));
}

}  // namespace sim
