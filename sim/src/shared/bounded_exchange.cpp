#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "messages/update_codec.h"
#include "shared/body_costs.h"
#include "shared/replica.h"
#include "shared/replica_protocol.h"
#include "shared/shared_contacts.h"
#include "shared/structures.h"

namespace sim {
namespace {

// Every worker is at a step of its own. Its world holds its bodies; of the others' bodies those that may come
// near are put in as ghosts for each step, and move with them.
//
// A contact between bodies of two owners is resolved by both (SharedContacts), and workers whose bodies touch keep closer to
// each other (touching_lead).
class BoundedExchange final : public ReplicaProtocol {
public:
    explicit BoundedExchange(const SceneMessage& scene);

    using ReplicaProtocol::take;
    void take(const MessageHeader& header, PackedUpdates&& message) override;
    void take(SnapshotMessage&& message) override;
    void members(const Members& message, std::uint32_t epoch) override;
    void own(const Ownership& ownership) override;
    // Who came to the last step by taking bodies over has to say so, and where it is who goes on to a step in which bodies come.
    [[nodiscard]] bool owes() const override {
        return published_ < step_ && (owned_.empty() ? owners_.contains(self_) : at_end());
    }
    [[nodiscard]] bool ready() const override;
    void step(const StepChannel& channel) override;
    [[nodiscard]] std::vector<std::uint8_t> publish(std::uint32_t epoch, const StepReport& report) override;
    void follow() override;
    [[nodiscard]] Holdings holdings() override;
    [[nodiscard]] Handover give(const std::vector<std::uint32_t>& bodies) override;
    void weigh() override { costs_.add(world_, owned_); }
    [[nodiscard]] std::uint64_t steps_done() const override { return step_; }
    [[nodiscard]] bool at_end() const override { return step_ >= settings_.steps; }
    [[nodiscard]] bool done() const override { return at_end() && settled_; }
    [[nodiscard]] int own_bodies() const override { return static_cast<int>(owned_.size()); }
    [[nodiscard]] bool has_nothing() const override { return owned_.empty() && later_.empty(); }
    [[nodiscard]] int lead() const override;
    [[nodiscard]] int ghost_age() const override { return ghost_age_; }
    [[nodiscard]] const World& world() const override { return world_; }
    void use_threads(int threads) override { world_.use_threads(threads); }

private:
    struct Felt {                   // what other bodies of this worker do to an own one
        StepImpulse mean;           // of a step
        int steps = 0;              // that it is of
        std::uint64_t held = 0;     // step in which they last did anything
        std::uint64_t touched = 0;  // step in which it last touched another worker's
        bool watched = false;       // in the step
    };
    void come_to(std::uint64_t step);
    void list();
    void set_own(int body, bool own);
    void take_over(const Ownership& ownership);
    void take_due();
    void place_ghosts();
    void keep_crossed();
    void feel();
    [[nodiscard]] std::vector<std::uint8_t> publish_last(std::uint32_t epoch, const StepReport& report) const;
    [[nodiscard]] std::uint64_t known(std::uint32_t worker) const {
        const auto found = known_.find(worker);
        return found == known_.end() ? 0 : found->second;
    }
    [[nodiscard]] std::uint64_t slowest() const;
    [[nodiscard]] bool owns_any(std::uint32_t worker) const;
    void tell(int body, Update& update);

    std::uint32_t self_;
    DistributedSettings settings_;
    World world_;
    SceneClock clock_;
    BodyCosts costs_;
    ColumnWatch columns_;
    PlannedStructures planned_;
    ForeignBodies foreign_;
    std::uint64_t published_ = 0;  // step
    std::uint64_t step_ = 0;
    std::vector<std::uint32_t> owner_;  // as registered
    std::set<std::uint32_t> owners_;    // who has any
    std::vector<std::uint8_t> own_;
    std::vector<int> owned_, others_;  // there, ascending; moving ones of others
    std::vector<std::uint32_t> members_;
    bool owners_follow_ = true;  // not all owners are known
    SharedContacts contacts_;
    std::map<std::uint32_t, std::uint64_t> known_;  // workers: step that they have done
    std::map<std::uint32_t, std::uint64_t> told_;   // workers: step of their last message
    std::vector<Ownership> later_;
    std::vector<ForeignBall> balls_;
    std::vector<int> near_;
    std::vector<CrossImpulse> crossed_;              // in the last step
    WorldRecord record_;                             // of the body that is being told of
    WorkerMessage outgoing_ = UpdateMessage{};       // kept for its storage
    std::vector<std::uint32_t> breakable_, broken_;  // constraints; those that broke in the last step
    std::map<int, Felt> felt_;                       // of own bodies that touch others'
    std::vector<std::uint8_t> told_asleep_;
    struct Touch {
        std::uint64_t step = 0;  // in which their bodies and own ones last touched
        int pairs = 0;           // of bodies, then
    };
    std::map<std::uint32_t, Touch> touched_;  // workers
    int ghost_age_ = 0;
    bool settled_ = false;
};

constexpr std::uint64_t kTouchingSteps = 4;

constexpr std::uint64_t kForever = ~std::uint64_t{0};

int keep_steps(int bound) {
    return 2 * blow_window(bound);
}

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

BoundedExchange::BoundedExchange(const SceneMessage& scene)
    : self_(scene.worker),
      settings_(scene.settings),
      world_(scene.scene.world),
      clock_(scene.scene),
      costs_(clock_.bodies()),
      columns_(scene.scene),
      planned_(scene.scene, columns_.side(),
               structure_outlook(scene.settings.bound, scene.scene.world.settings.dt)),
      foreign_(world_, self_, clock_.bodies(), keep_steps(scene.settings.bound)),
      contacts_(world_, foreign_, self_, {own_, owner_}, keep_steps(scene.settings.bound),
                blow_window(scene.settings.bound)) {
    const auto n = static_cast<std::size_t>(clock_.bodies());
    owner_.assign(n, kApplication), own_.assign(n, 0), told_asleep_.assign(n, 0);
    for (std::size_t c = 0; c < scene.scene.world.constraints.size(); ++c)
        if (std::isfinite(scene.scene.world.constraints[c].breaking_force))
            breakable_.push_back(static_cast<std::uint32_t>(c));
    world_.share(Sharing::pairs);
    for (int i = 0; i < world_.bodies(); ++i) {
        if (!clock_.moves(i)) continue;
        world_.set_own(i, false);
        foreign_.set(world_.record(i), 0);
    }
    list();
}

void BoundedExchange::list() {
    owned_.clear(), others_.clear();
    for (int i = 0; i < world_.bodies(); ++i) {
        if (!clock_.moves(i)) continue;
        (own_[static_cast<std::size_t>(i)] != 0 ? owned_ : others_).push_back(i);
    }
}

void BoundedExchange::set_own(int body, bool own) {
    own_[static_cast<std::size_t>(body)] = own;
    if (body < world_.bodies()) world_.set_own(body, own);
    felt_.erase(body);
    told_asleep_[static_cast<std::size_t>(body)] = 0;
    if (own) costs_.forget(body);
}

// Without own bodies: events up to there, too.
void BoundedExchange::come_to(std::uint64_t step) {
    const int before = world_.bodies();
    clock_.apply(world_, step);
    for (int i = before; i < world_.bodies(); ++i) {
        const bool own = own_[static_cast<std::size_t>(i)] != 0;
        world_.set_own(i, own);
        if (clock_.moves(i) && !own && !foreign_.known(i)) foreign_.set(world_.record(i), step);
    }
    if (world_.bodies() != before) list();
}

void BoundedExchange::take(const MessageHeader& header, PackedUpdates&& message) {
    std::uint64_t &known = known_[header.worker], &told = told_[header.worker];
    if (header.step <= told || known == kForever) return;  // what was told stands
    told = header.step, known = std::max(known, told);
    for (const std::uint32_t constraint : message.broken)
        world_.remove_constraint(static_cast<int>(constraint));
    int pairs = 0;
    for (const CrossImpulse& c : message.crossed) {
        if (std::max(c.own, c.ghost) >= clock_.bodies())
            throw DecodeError("found an impulse between bodies that are none");
        pairs += own_[static_cast<std::size_t>(c.ghost)] != 0;
    }
    if (pairs > 0) touched_[header.worker] = {std::max(step_, header.step), pairs};
    foreign_.take(header.worker, header.step, std::move(message));
    if (header.step <= step_) contacts_.compare(header.worker, header.step, step_);
}

// Bodies follow with their owners.
void BoundedExchange::take(SnapshotMessage&& message) {
    world_.restore_contacts({}, message.snapshot.springs);
    come_to(message.snapshot.step);
}

void BoundedExchange::members(const Members& message, std::uint32_t) {
    for (const std::uint32_t was : members_)
        if (std::ranges::find(message.workers, was) == message.workers.end()) known_[was] = kForever;
    members_ = message.workers;
    owners_follow_ = message.owners_follow;
}

void BoundedExchange::own(const Ownership& ownership) {
    const std::uint32_t owner = ownership.owner;
    const bool first = !owners_.contains(owner);
    // A worker that owned nothing begins here.
    if (first && owner != self_) known_[owner] = std::max(known_[owner], ownership.step);
    for (const WorldRecord& record : ownership.bodies) {
        owner_[static_cast<std::size_t>(record.body)] = owner;
        if (ownership.from != kApplication) contacts_.sold(record.body, ownership.from, ownership.step);
        if (owner != self_ && own_[static_cast<std::size_t>(record.body)] != 0) set_own(record.body, false);
        // As last published: members already have that message, with the forces that held the bodies.
        if (ownership.traded || foreign_.newest(record.body) < ownership.step)
            foreign_.set(record, ownership.step);
    }
    owners_ = {owner_.begin(), owner_.end()};
    if (owner == self_) {
        later_.push_back(ownership);
        follow();
        take_due();
    }
    list();
}

// Without bodies that are there: on to the first that come, but not past anybody.
void BoundedExchange::follow() {
    if (!owned_.empty() || later_.empty()) return;
    std::uint64_t next = slowest();
    for (const Ownership& later : later_) next = std::min(next, later.step);
    if (next <= step_) return;
    come_to(next);
    step_ = next;
    world_.set_step(step_);
    take_due();
}

void BoundedExchange::take_due() {
    for (std::size_t i = 0; i < later_.size();) {
        if (later_[i].step > step_) {
            ++i;
            continue;
        }
        const Ownership ownership = std::move(later_[i]);
        later_.erase(later_.begin() + static_cast<std::ptrdiff_t>(i));
        take_over(ownership);
    }
}

// The bodies as they are at this worker's step.
void BoundedExchange::take_over(const Ownership& ownership) {
    settled_ = false;
    std::map<std::uint32_t, std::uint64_t> compared;
    for (std::size_t i = 0; i < ownership.sources.size(); ++i)
        compared[ownership.sources[i]] = ownership.applied[i];
    for (const WorldRecord& record : ownership.bodies) {
        const int body = record.body;
        if (owner_[static_cast<std::size_t>(body)] != self_) continue;  // gone again
        if (body < world_.bodies()) {
            WorldRecord now = record;
            if (step_ > ownership.step) {
                const ForeignBodies::Ghost& ghost = foreign_.at(body, step_);
                now.state = ghost.state;
                now.asleep = now.asleep && ghost.asleep;
            }
            set_own(body, true);
            world_.restore(now);
            if (!compared.empty()) contacts_.took(body, compared);
        } else {
            set_own(body, true);
            if (owned_.empty())
                come_to(step_);  // its event may be due, and nothing else takes this worker on
        }
    }
    list();
}

bool BoundedExchange::owns_any(std::uint32_t worker) const {
    return std::find(members_.begin(), members_.end(), worker) != members_.end() && owners_.contains(worker);
}

std::uint64_t BoundedExchange::slowest() const {
    if (owners_follow_) return 0;  // whoever that may be
    std::uint64_t slowest = kForever;
    for (const std::uint32_t worker : members_) {
        if (worker == self_ || !owns_any(worker)) continue;
        slowest = std::min(slowest, known(worker));
    }
    return slowest;
}

int BoundedExchange::lead() const {
    const std::uint64_t least = slowest();
    return least < step_ ? static_cast<int>(step_ - least) : 0;
}

bool BoundedExchange::ready() const {
    if (owned_.empty() || owners_follow_) return false;
    if (at_end()) return !settled_ && slowest() >= settings_.steps;
    if (lead() > settings_.bound) return false;
    return std::all_of(touched_.begin(), touched_.end(), [&](const auto& t) {
        const auto& [worker, touch] = t;
        return touch.step + kTouchingSteps < step_ || !owns_any(worker) ||
               known(worker) + touching_lead(settings_.bound, touch.pairs) >= step_;
    });
}

void BoundedExchange::place_ghosts() {
    balls_.clear();
    for (const int body : others_)
        if (foreign_.known(body) && !foreign_.quarantined(body)) balls_.push_back(foreign_.ball(body, step_));
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
        const Eigen::Vector3d linear = as_sent(c.linear), angular = as_sent(c.angular_own);
        world_.kick(c.own, linear - c.linear, angular - c.angular_own);
        c.linear = linear, c.angular_own = angular;
        c.angular_ghost = as_sent(c.angular_ghost);
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
        if (known >= step_) contacts_.compare(worker, step_, step_);
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

void BoundedExchange::step(const StepChannel&) {
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
std::vector<std::uint8_t> BoundedExchange::publish_last(std::uint32_t epoch, const StepReport& report) const {
    StateMessage message;
    message.report = report;
    for (const int body : owned_) message.bodies.push_back(world_.record(body));
    return encode({self_, epoch, step_}, message);
}

std::vector<std::uint8_t> BoundedExchange::publish(std::uint32_t epoch, const StepReport& report) {
    if (settled_) return publish_last(epoch, report);
    auto& message = std::get<UpdateMessage>(outgoing_);
    message.report = report;
    std::size_t count = 0;
    for (const int body : owned_) {
        std::uint8_t& told = told_asleep_[static_cast<std::size_t>(body)];
        const bool asleep = world_.asleep(body);
        if (asleep && told != 0) continue;
        told = asleep;
        if (count == message.bodies.size()) message.bodies.emplace_back();
        tell(body, message.bodies[count++]);
    }
    message.bodies.resize(count);
    message.crossed.swap(crossed_), crossed_.clear();
    message.broken.swap(broken_), broken_.clear();
    published_ = step_;
    return encode({self_, epoch, step_}, outgoing_);
}

Holdings BoundedExchange::holdings() {
    const auto place = [this](int body) {
        const bool told = !world_.own(body) && foreign_.known(body);
        return told ? foreign_.last_position(body) : world_.state(body).position;
    };
    std::vector<OthersBody> others;
    for (const int body : others_) {
        if (!is_flat(world_.definition(body)) || !foreign_.known(body)) continue;
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

Handover BoundedExchange::give(const std::vector<std::uint32_t>& bodies) {
    Handover handover;
    handover.sources = {self_}, handover.applied = {step_};
    for (const auto& [worker, told] : told_)
        handover.sources.push_back(worker), handover.applied.push_back(std::min(told, step_));
    for (const std::uint32_t id : bodies) {
        const int body = static_cast<int>(id);
        handover.bodies.push_back(world_.record(body));
        foreign_.set(handover.bodies.back(), step_);
        set_own(body, false);
    }
    list();
    return handover;
}

}  // namespace

std::unique_ptr<ReplicaProtocol> make_bounded_exchange(const SceneMessage& scene) {
    return std::make_unique<BoundedExchange>(scene);
}

}  // namespace sim
