#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "messages/update_codec.h"
#include "shared/body_costs.h"
#include "shared/neighbour_check.h"
#include "shared/neighbour_streams.h"
#include "shared/neighbour_telling.h"
#include "shared/replica.h"
#include "shared/replica_protocol.h"
#include "shared/shared_contacts.h"
#include "shared/structures.h"

namespace sim {
namespace {

// Every worker is at a step of its own. Its world holds its bodies; of the others' bodies those that may come
// near are put in as ghosts for each step, and move with them.
//
// After a step it tells every other worker which of its bodies may come near that one's, as far as it knows where these are, and
// what it found at contacts with them; the application is told of all bodies. A body that is not named is far away. What sleeps is
// told once to each, when it is near, and once more when it wakes.
//
// Bodies change owners at a step which all other owners have told the seller, see may_give: so it has compared with them what was found
// up to there, and the buyer compares what comes after. Who does not know yet of a sale tells the seller what it finds at these bodies;
// as soon as it knows it tells the buyer (FoundMessage). Until all have done so the buyer
// compares nothing of them. What a worker says that knows of a sale counts once this one knows of it, and has heard the seller up to it.
//
// A contact between bodies of two owners is resolved by both (SharedContacts), and workers whose bodies touch keep closer to
// each other (touching_lead).
class BoundedExchange final : public ReplicaProtocol {
public:
    explicit BoundedExchange(const SceneMessage& scene);

    using ReplicaProtocol::take;
    void take(const MessageHeader& header, NeighbourMessage&& message) override;
    void take(const MessageHeader& header, FoundMessage&& message) override;
    void take(const MessageHeader& header, const HeardMessage& message) override;
    void take(SnapshotMessage&& message) override;
    void members(const Members& message, std::uint32_t epoch) override;
    void own(const Ownership& ownership, std::uint32_t epoch) override;
    // Who came to the last step by taking bodies over has to say so, and where it is who goes on to a step in which bodies come.
    [[nodiscard]] bool owes() const override {
        return published_ < step_ && (owned_.empty() ? owners_.contains(self_) : at_end());
    }
    [[nodiscard]] bool ready() const override;
    void step(const StepChannel& channel) override;
    void publish(std::uint32_t epoch, const StepReport& report) override;
    void follow() override;
    [[nodiscard]] Holdings holdings() override;
    [[nodiscard]] bool may_give() const override;
    [[nodiscard]] bool all_have_heard() override;
    void ask_again() override;
    [[nodiscard]] std::uint64_t steps_of(std::uint32_t worker) const override { return known(worker); }
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
    struct Later {
        Ownership ownership;
        std::uint32_t epoch;
    };
    void take_over(const Later& later);
    void take_due();
    void place_ghosts();
    void keep_crossed();
    void feel();
    void publish_last(const StepReport& report) const;
    void tell_neighbours(const StepReport& report);
    void tell(std::uint32_t worker);
    void tell(int body, Update& update);
    void see(int body, const WorldBodyState& state, bool asleep);
    void pack(std::size_t which);
    template <typename Check>
    static void checked(const MessageHeader& header, Check check) {
        try {
            check();
        } catch (const DecodeError& wrong) {
            throw PeerError(header.worker, wrong.what());
        }
    }
    [[nodiscard]] bool is_told(int body) const;
    void hear_all();
    void hear(const MessageHeader& header, NeighbourMessage&& message);
    void hear(const MessageHeader& header, FoundMessage&& message);
    void take_around(const Ownership& ownership);
    void bought(std::vector<int>&& bodies, std::uint32_t epoch);
    void complete();
    void compare(std::uint32_t worker, std::uint64_t step) {
        if (step <= step_) contacts_.compare(worker, step, step_);
    }
    void see_own();
    [[nodiscard]] std::vector<WorldRecord> coming() const;
    void tell_in_order(std::uint32_t to, const WorkerMessage& message);
    void send(std::uint32_t to, const WorkerMessage& message, bool by_application) const {
        send_({to}, encode({self_, epoch_, step_}, message), by_application);
    }
    [[nodiscard]] std::uint64_t known(std::uint32_t worker) const {
        const auto found = known_.find(worker);
        return found == known_.end() ? 0 : found->second;
    }
    [[nodiscard]] std::uint64_t told(std::uint32_t worker) const {
        const auto found = told_.find(worker);
        return found == told_.end() ? 0 : found->second;
    }
    [[nodiscard]] std::uint32_t epoch_of(std::uint32_t worker) const {
        const auto found = knows_.find(worker);
        return found == knows_.end() ? 0 : found->second;
    }
    [[nodiscard]] std::uint64_t slowest() const;
    [[nodiscard]] bool all_is_told(std::uint64_t step) const;
    [[nodiscard]] bool begins_at(std::uint32_t worker, std::uint64_t step) const;
    [[nodiscard]] bool is_waited_for() const;
    [[nodiscard]] bool owns_any(std::uint32_t worker) const;

    std::uint32_t self_, epoch_ = 0;
    DistributedSettings settings_;
    NeighbourCheck check_;
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
    std::vector<std::uint32_t> since_;  // bodies: epoch of that, or in which the application told of them
    std::vector<std::uint8_t> own_, awaits_;  // awaits_: own, and what others found at it is not known
    std::vector<int> owned_, others_;         // there, ascending; moving ones of others
    std::vector<std::uint32_t> members_;
    bool owners_follow_ = true;  // not all owners are known
    SharedContacts contacts_;
    std::map<std::uint32_t, std::uint64_t> known_;  // workers: step that they have done
    std::map<std::uint32_t, std::uint64_t> told_;   // workers: step of their last message
    std::map<std::uint32_t, std::uint32_t> knows_;  // workers: epoch of their last message
    std::map<std::uint32_t, std::uint64_t>
        begun_;          // workers that owned nothing before: step in which they got bodies
    bool late_ = false;  // others were under way before this one came
    NeighbourStreams streams_;
    std::map<std::uint32_t, std::uint32_t>
        asked_up_to_;  // workers: number of a message that they may not have heard
    struct Sold {
        std::uint32_t epoch, from;
        std::uint64_t step;
    };
    std::vector<Sold> sold_;  // by others, that have not been heard up to there
    std::vector<Later> later_;
    std::vector<ForeignBall> balls_;
    std::vector<int> near_;
    std::vector<CrossImpulse> crossed_;              // in the last step
    WorldRecord record_;                             // of the body that is being told of
    std::vector<std::uint32_t> breakable_, broken_;  // constraints; those that broke in the last step
    std::vector<int> first_of_constraint_;           // the first body of each that moves
    std::map<int, Felt> felt_;                       // of own bodies that touch others'
    std::vector<std::uint8_t> told_asleep_;          // the application was
    // Kept for their storage:
    WorkerMessage outgoing_ = UpdateMessage{}, to_neighbour_ = NeighbourMessage{};
    Update update_;
    NeighbourTelling telling_;
    struct Packed {  // of each own body, as seen by telling_
        int body;
        std::int32_t update = -1, at = -1;  // in the message to the application, in packed_; -1: not there
    };
    std::vector<Packed> seen_;
    PackedUpdates packed_;            // as neighbours need them
    std::vector<std::uint8_t> flat_;  // bodies that are there: is_flat
    /// Own bodies at which others have found what they have not yet told.
    struct Purchase {
        std::uint32_t epoch;
        std::set<std::uint32_t> silent;  // workers
        std::vector<int> bodies = {};
        std::optional<std::uint64_t> step = {};  // up to which it is compared; none: they are not there yet
        [[nodiscard]] bool is_complete() const { return step && silent.empty(); }
    };
    std::vector<Purchase> purchases_;
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
constexpr std::uint32_t kTellHeardAfter = 16;  // messages

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
      check_(with_later(scene.scene), scene.scene.world.constraints.size(), scene.settings.steps),
      world_(scene.scene.world),
      clock_(scene.scene),
      costs_(clock_.bodies()),
      columns_(scene.scene),
      planned_(scene.scene, columns_.side(),
               structure_outlook(scene.settings.bound, scene.scene.world.settings.dt)),
      foreign_(world_, self_, clock_.bodies(), keep_steps(scene.settings.bound)),
      contacts_(world_, foreign_, self_, {own_, awaits_, owner_}, keep_steps(scene.settings.bound),
                blow_window(scene.settings.bound)),
      streams_(static_cast<std::size_t>(clock_.bodies()), scene.settings.bound),
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
    world_.share(Sharing::pairs);
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
    checked(header, [&] {
        check_.check(header, message);
        streams_.heard_by(header.worker, message.heard);
        streams_.put(header, std::move(message));
    });
    hear_all();
}

void BoundedExchange::take(const MessageHeader& header, FoundMessage&& message) {
    if (!telling_.has(header.worker)) return;
    checked(header, [&] {
        check_.check(header, message);
        streams_.put(header, std::move(message));
    });
    hear_all();
}

// Answers go by way of the application, which sees that this one is there.
void BoundedExchange::take(const MessageHeader& header, const HeardMessage& message) {
    if (!telling_.has(header.worker)) return;
    streams_.heard_by(header.worker, message.number);
    if (!message.again) return;
    for (std::vector<std::uint8_t>& bytes : streams_.again(header.worker))
        send_({header.worker}, std::move(bytes), true);
    send(header.worker, HeardMessage{streams_.tell_heard(header.worker), false}, true);
}

// Whatever has its turn now.
void BoundedExchange::hear_all() {
    std::uint32_t epoch = epoch_;
    for (bool any = true; any;) {
        any = false;
        for (const Sold& sold : sold_) epoch = std::min(epoch, sold.epoch - 1);
        telling_.each([&](std::uint32_t worker) {
            while (std::optional<NeighbourStreams::Heard> next = streams_.take(worker, epoch)) {
                any = true;
                std::visit([&](auto&& m) { hear(next->header, std::move(m)); }, std::move(next->message));
            }
            // Who tells nothing of steps says so otherwise.
            if (streams_.untold(worker) >= kTellHeardAfter && (owned_.empty() || at_end()))
                send(worker, HeardMessage{streams_.tell_heard(worker), false}, false);
        });
        std::erase_if(sold_, [this](const Sold& sold) { return told(sold.from) >= sold.step; });
        epoch = epoch_;
    }
}

void BoundedExchange::hear(const MessageHeader& header, NeighbourMessage&& message) {
    const std::uint32_t worker = header.worker;
    knows_[worker] = header.epoch;
    std::uint64_t &known = known_[worker], &told = told_[worker];
    if (header.step <= told) return;  // once more, as when this one had just joined
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

void BoundedExchange::hear(const MessageHeader& header, FoundMessage&& message) {
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
void BoundedExchange::take(SnapshotMessage&& message) {
    late_ = true;
    world_.restore_contacts({}, message.snapshot.springs);
    come_to(message.snapshot.step);
}

void BoundedExchange::members(const Members& message, std::uint32_t epoch) {
    epoch_ = epoch;
    for (const std::uint32_t was : members_) {
        if (std::ranges::find(message.workers, was) != message.workers.end()) continue;
        known_[was] = kForever;
        telling_.remove(was), streams_.remove(was);
        std::erase_if(sold_, [was](const Sold& sold) { return sold.from == was; });
        for (Purchase& purchase : purchases_) purchase.silent.erase(was);
    }
    members_ = message.workers;
    complete();
    hear_all();
    for (const std::uint32_t worker : members_) {
        if (worker == self_ || telling_.has(worker)) continue;
        telling_.add(worker), streams_.add(worker);
        if (step_ == 0 && !late_) continue;
        see_own();  // it has to know how far this one is
        auto& told = std::get<NeighbourMessage>(to_neighbour_);
        told.own = static_cast<std::uint32_t>(owned_.size());
        told.reach = telling_.reach(coming()), told.broken.clear(), told.places.clear();
        for (const std::uint32_t c : breakable_)
            if (!world_.constraint_holds(static_cast<int>(c))) told.broken.push_back(c);
        tell(worker);
    }
    owners_follow_ = message.owners_follow;
}

// Others' bodies, unless more is known of them. They count until their owners have heard of the change.
void BoundedExchange::take_around(const Ownership& ownership) {
    for (std::size_t i = 0; i < ownership.around.size(); ++i) {
        const WorldRecord& record = ownership.around[i];
        const auto at = static_cast<std::size_t>(record.body);
        if (own_[at] != 0 || owner_[at] == self_) continue;
        since_[at] = epoch_;
        if (!foreign_.known(record.body) || foreign_.newest(record.body) < ownership.around_step[i])
            foreign_.set(record, ownership.around_step[i]);
    }
}

void BoundedExchange::own(const Ownership& ownership, std::uint32_t epoch) {
    epoch_ = epoch;
    const std::uint32_t owner = ownership.owner, from = ownership.from;
    const bool changes = from != kApplication && from != owner;  // else they are the first, or come back
    // A worker that owned nothing begins here.
    if (owner != self_ && !owners_.contains(owner)) {
        begun_[owner] = ownership.step;
        known_[owner] = std::max(known_[owner], ownership.step);
    }
    std::vector<int> bodies;
    for (const WorldRecord& record : ownership.bodies) {
        const auto at = static_cast<std::size_t>(record.body);
        bodies.push_back(record.body);
        since_[at] = epoch, owner_[at] = owner;
        if (changes) contacts_.sold(record.body, from, ownership.step);
        if (owner != self_ && own_[at] != 0) set_own(record.body, false);
        // As last published: who was told has that, with the forces that held the bodies. What a lost worker told besides is void.
        if (ownership.traded || foreign_.newest(record.body) != ownership.step)
            foreign_.set(record, ownership.step);
    }
    owners_ = {owner_.begin(), owner_.end()};
    std::ranges::sort(bodies);
    // (Who got bodies at that step has found nothing before.)
    if (changes && telling_.has(from) && told(from) < ownership.step && !begins_at(from, ownership.step))
        sold_.push_back({epoch, from, ownership.step});
    if (owner == self_) {
        take_around(ownership);
        if (changes) {
            purchases_.push_back({epoch, {}});
            telling_.each([this](std::uint32_t worker) { purchases_.back().silent.insert(worker); });
        }
        later_.push_back({ownership, epoch});
        follow();
        take_due();
    } else if (telling_.has(owner)) {
        see_own();
        telling_.got(owner, ownership.bodies, epoch);
        if (changes)
            tell_in_order(owner, FoundMessage{streams_.next_number(owner), epoch, foreign_.found_at(bodies)});
    }
    list();
    hear_all();
}

// Without bodies that are there: on to the first that come, but not past anybody.
void BoundedExchange::follow() {
    if (!owned_.empty() || later_.empty()) return;
    std::uint64_t next = slowest();
    for (const Later& later : later_) next = std::min(next, later.ownership.step);
    if (next <= step_) return;
    come_to(next);
    step_ = next;
    world_.set_step(step_);
    take_due();
}

void BoundedExchange::take_due() {
    for (std::size_t i = 0; i < later_.size();) {
        if (later_[i].ownership.step > step_) {
            ++i;
            continue;
        }
        const Later due = std::move(later_[i]);
        later_.erase(later_.begin() + static_cast<std::ptrdiff_t>(i));
        take_over(due);
    }
}

// The bodies as they are at this worker's step.
void BoundedExchange::take_over(const Later& later) {
    const Ownership& ownership = later.ownership;
    settled_ = false;
    std::vector<int> bodies;
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
            bodies.push_back(body);
        } else {
            set_own(body, true);
            if (owned_.empty())
                come_to(step_);  // its event may be due, and nothing else takes this worker on
        }
    }
    list();
    bought(std::move(bodies), later.epoch);
}

// They are own from here on, up to where the seller compared what others found. (Of a lost worker's bodies nobody knows what was compared.)
void BoundedExchange::bought(std::vector<int>&& bodies, std::uint32_t epoch) {
    const auto purchase = std::ranges::find(purchases_, epoch, &Purchase::epoch);
    if (purchase == purchases_.end()) return;  // they come back
    for (const int body : bodies) awaits_[static_cast<std::size_t>(body)] = 1;
    purchase->bodies = std::move(bodies), purchase->step = step_;
    complete();
}

// Purchases of which all others have told what they found.
void BoundedExchange::complete() {
    for (const Purchase& purchase : purchases_) {
        if (!purchase.is_complete()) continue;
        for (const int body : purchase.bodies) {
            const auto at = static_cast<std::size_t>(body);
            if (own_[at] == 0 || since_[at] != purchase.epoch) continue;
            awaits_[at] = 0;
            for (const auto& [worker, heard] : foreign_.all())
                if (worker != self_)
                    contacts_.took(body, worker, *purchase.step, std::min(told(worker), step_));
        }
    }
    std::erase_if(purchases_, [](const Purchase& purchase) { return purchase.is_complete(); });
}

// Whether all is known here that others found up to a step.
bool BoundedExchange::all_is_told(std::uint64_t step) const {
    return std::ranges::all_of(members_, [&](std::uint32_t worker) {
        return worker == self_ || !owns_any(worker) || told(worker) >= step || begins_at(worker, step);
    });
}

bool BoundedExchange::begins_at(std::uint32_t worker, std::uint64_t step) const {
    const auto begun = begun_.find(worker);
    return begun != begun_.end() && begun->second >= step;
}

// What others have not told of own bodies for so long would be forgotten here before it is compared. And what another one has not heard
// is kept.
bool BoundedExchange::is_waited_for() const {
    bool waits = std::ranges::any_of(purchases_, [this](const Purchase& p) {
        return p.step && *p.step + static_cast<std::uint64_t>(blow_window(settings_.bound)) <= step_;
    });
    telling_.each([&](std::uint32_t worker) { waits = waits || streams_.is_full(worker); });
    return waits;
}

// What others found up to this step at own bodies is known and compared.
bool BoundedExchange::may_give() const {
    return sold_.empty() && all_is_told(step_) &&
           std::ranges::none_of(purchases_, [](const Purchase& p) { return p.step.has_value(); });
}

bool BoundedExchange::all_have_heard() {
    bool all = true;
    telling_.each([&](std::uint32_t worker) {
        if (streams_.all_heard_by(worker)) return;
        all = false;
        const std::uint32_t next = streams_.next_number(worker);
        if (std::exchange(asked_up_to_[worker], next) == next) return;
        send(worker, HeardMessage{streams_.tell_heard(worker), true}, true);
    });
    return all;
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
    if (at_end()) return !settled_ && may_give();
    if (lead() > settings_.bound || is_waited_for()) return false;
    return std::all_of(touched_.begin(), touched_.end(), [&](const auto& t) {
        const auto& [worker, touch] = t;
        return touch.step + kTouchingSteps < step_ || !owns_any(worker) ||
               known(worker) + touching_lead(settings_.bound, touch.pairs) >= step_;
    });
}

void BoundedExchange::ask_again() {
    telling_.each([this](std::uint32_t worker) {
        send(worker, HeardMessage{streams_.tell_heard(worker), true}, true);
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
    send_({}, encode({self_, epoch_, step_}, message), true);
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
    send_({}, encode({self_, epoch_, step_}, outgoing_), true);
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
    message.number = streams_.next_number(worker), message.heard = streams_.tell_heard(worker);
    message.bodies.clear();
    for (const std::size_t which : telling_.choose(worker, step_)) {
        pack(which);
        message.bodies.add(packed_, packed_.places()[static_cast<std::size_t>(seen_[which].at)]);
    }
    message.crossed.clear();
    std::ranges::copy_if(crossed_, std::back_inserter(message.crossed), [&](const CrossImpulse& c) {
        return owner_[static_cast<std::size_t>(c.ghost)] == worker;
    });
    tell_in_order(worker, to_neighbour_);
}

void BoundedExchange::tell_in_order(std::uint32_t to, const WorkerMessage& message) {
    std::vector<std::uint8_t> bytes = encode({self_, epoch_, step_}, message);
    streams_.sent(to, bytes);
    send_({to}, std::move(bytes), false);
}

// Bodies that are registered for this worker, and come in later steps.
std::vector<WorldRecord> BoundedExchange::coming() const {
    std::vector<WorldRecord> bodies;
    for (const Later& later : later_)
        bodies.insert(bodies.end(), later.ownership.bodies.begin(), later.ownership.bodies.end());
    return bodies;
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

Handover BoundedExchange::give(const std::vector<std::uint32_t>& bodies) {
    Handover handover;
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
