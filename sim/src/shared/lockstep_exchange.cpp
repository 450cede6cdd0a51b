#include <algorithm>
#include <deque>
#include <map>
#include <optional>
#include <utility>

#include "shared/body_costs.h"
#include "shared/replica.h"
#include "shared/replica_protocol.h"
#include "solver/island_blocks.h"
#include "world/partners.h"

namespace sim {
namespace {

constexpr std::uint64_t kStepsAlone = 64;  // after one in which another told nothing, or nothing that can be

// Every worker has a whole replica, and whoever owns something does every step for all bodies. Those who published the records
// of t do the step from t to t + 1 together (world/partners.h): they all know who they are. Who cannot, or finds that another
// cannot, tells the others so and does it alone, all of it. Either way a worker publishes own records at t + 1, with the same
// bits, and goes on when all bodies were published there: nobody is further than one step from another. Who owns nothing
// copies what the others publish, or, where that was not sent to it, listens to what they tell each other.
//
// Ownership comes with a record at some step s, the last that was published. Nobody can be further than
// s + 1, and a worker that is already there waits for these bodies:
//   s = own step        they are own from here on
//   s = own step - 1    they are own, and published at the own step, too
//   s > own step        waits until this worker is there
class LockstepExchange final : public ReplicaProtocol {
public:
    explicit LockstepExchange(const SceneMessage& scene);

    using ReplicaProtocol::take;
    void take(const MessageHeader& header, StateMessage&& message) override;
    void take(const MessageHeader& header, PublishedMessage&& message) override;
    void take(const MessageHeader& header, PartMessage&& message) override;
    void take(SnapshotMessage&& message) override;
    void members(const Members& message, std::uint32_t epoch) override;
    void members_within(const std::vector<std::uint32_t>& workers) override;
    void own(const Ownership& ownership, std::uint32_t epoch) override;
    [[nodiscard]] bool owes() const override { return owes_; }
    [[nodiscard]] bool ready() const override;
    void step(const StepChannel& channel) override;
    void publish(std::uint32_t epoch, const StepReport& report) override;
    void follow() override;
    [[nodiscard]] Holdings holdings() override;
    [[nodiscard]] Handover give(const std::vector<std::uint32_t>& bodies) override;
    void weigh() override { costs_.add(replica_.world(), owned_); }
    [[nodiscard]] std::uint64_t steps_done() const override { return replica_.step(); }
    [[nodiscard]] bool at_end() const override { return replica_.step() >= steps_; }
    [[nodiscard]] bool done() const override { return at_end(); }
    [[nodiscard]] int own_bodies() const override { return static_cast<int>(owned_.size()); }
    [[nodiscard]] int lead() const override { return replica_.whole() ? 0 : 1; }
    [[nodiscard]] int ghost_age() const override { return 0; }
    [[nodiscard]] bool was_alone() const override { return was_alone_; }
    [[nodiscard]] const World& world() const override { return replica_.world(); }
    void use_threads(int threads) override { replica_.world().use_threads(threads); }

private:
    class Together;
    struct Part {
        std::uint64_t step;
        bool gave_up;
        std::vector<std::uint8_t> bytes;
    };

    void note_publisher(const MessageHeader& header, std::uint32_t body);
    [[nodiscard]] std::vector<std::uint32_t> publishers(std::uint64_t step) const;
    [[nodiscard]] bool all_know_this() const;
    [[nodiscard]] bool owns_any() const { return std::ranges::find(own_, 1) != own_.end(); }
    [[nodiscard]] bool step_together(const StepChannel& channel);
    void wait_for_none();
    void look_for_lost(const std::vector<std::uint32_t>& workers);
    void tell(const StepChannel& channel, std::vector<std::uint32_t> to, bool gave_up,
              std::vector<std::uint8_t>&& bytes);
    [[nodiscard]] std::vector<std::uint8_t> hear(const StepChannel& channel, std::uint32_t from);
    void set_own(int body, bool own);
    void take_over(const Ownership& ownership);
    void settle();
    void list_owned();

    std::uint32_t self_;
    std::uint64_t steps_;
    Replica replica_;
    BodyCosts costs_;
    ColumnWatch columns_;
    std::vector<std::uint32_t> owner_;  // as registered
    std::vector<std::uint8_t> own_;     // now; with bodies that come in the next step
    std::vector<int> owned_;            // that are there, ascending; as of so many bodies, and own_:
    int listed_ = 0;
    bool own_changed_ = false;
    std::deque<Ownership> later_;  // own ones of later steps
    bool unpublished_ = false;     // between step() and publish()
    bool owes_ = false;
    WorkerMessage outgoing_ = StateMessage{};
    // Together.
    const bool may_together_;
    const std::size_t most_parts_;               // of one worker that wait here
    std::vector<std::uint32_t> others_;          // members, without this one
    std::optional<std::uint32_t> member_since_;  // epoch
    struct Publishers {
        std::vector<std::uint32_t> of;                 // each body's record; kApplication: none
        std::map<std::uint32_t, std::uint32_t> epoch;  // that they knew
    };
    std::map<std::uint64_t, Publishers> publisher_;  // by steps
    std::vector<std::uint32_t> partners_;            // of the step under way
    bool partner_lost_ = false, was_alone_ = false;
    std::map<std::uint32_t, std::deque<Part>> parts_;  // that others told, by them
    std::uint64_t alone_until_ = 0;                    // step
};

class LockstepExchange::Together final : public Partners {
public:
    Together(LockstepExchange& exchange, const StepChannel& channel, int self, std::vector<int> of)
        : Partners(self, static_cast<int>(exchange.partners_.size()), std::move(of)),
          exchange_(exchange),
          channel_(channel) {}
    void tell(int partner, Bytes&& bytes) override {
        exchange_.tell(channel_, {worker(partner)}, false, std::move(bytes));
    }
    void tell_all(Bytes&& bytes) override {
        if (self() >= 0) exchange_.tell(channel_, exchange_.others_, false, std::move(bytes));
    }
    [[nodiscard]] Bytes hear(int partner) override { return exchange_.hear(channel_, worker(partner)); }

private:
    [[nodiscard]] std::uint32_t worker(int partner) const {
        return exchange_.partners_[static_cast<std::size_t>(partner)];
    }
    LockstepExchange& exchange_;
    const StepChannel& channel_;
};

/// Whoever does a step alone.
class Alone final : public Partners {
public:
    Alone() : Partners(0, 1, {}) {}
    void tell(int, Bytes&&) override {}
    void tell_all(Bytes&&) override {}
    [[nodiscard]] Bytes hear(int) override { throw NotTogether("there is no other"); }
};

LockstepExchange::LockstepExchange(const SceneMessage& scene)
    : self_(scene.worker),
      steps_(scene.settings.steps),
      replica_(scene.scene),
      costs_(replica_.clock().bodies()),
      columns_(scene.scene),
      may_together_(scene.settings.together),
      most_parts_(most_parts(scene.scene)) {
    owner_.assign(static_cast<std::size_t>(replica_.clock().bodies()), kApplication);
    own_.assign(owner_.size(), 0);
}

void LockstepExchange::list_owned() {
    const int there = replica_.world().bodies();
    if (!std::exchange(own_changed_, false) && there == listed_) return;
    listed_ = there;
    owned_.clear();
    for (int i = 0; i < there; ++i)
        if (own_[static_cast<std::size_t>(i)] != 0) owned_.push_back(i);
}

void LockstepExchange::set_own(int body, bool own) {
    own_[static_cast<std::size_t>(body)] = own;
    own_changed_ = true;
    if (body < replica_.world().bodies()) replica_.world().set_own(body, own);
    if (own) costs_.forget(body);
}

void LockstepExchange::take(const MessageHeader& header, StateMessage&& message) {
    for (const WorldRecord& record : message.bodies)
        note_publisher(header, static_cast<std::uint32_t>(record.body));
    replica_.note(header.step, std::move(message));
    settle();
}

void LockstepExchange::take(const MessageHeader& header, PublishedMessage&& message) {
    for (const std::uint32_t body : message.bodies) note_publisher(header, body);
    replica_.mark(header.step, message.bodies);
    settle();
}

// The first counts, as with records.
void LockstepExchange::note_publisher(const MessageHeader& header, std::uint32_t body) {
    if (header.step < replica_.step() || body >= own_.size()) return;
    auto& [of, epoch] = publisher_[header.step];
    of.resize(own_.size(), kApplication);
    if (of[body] != kApplication) return;
    of[body] = header.worker;
    epoch.try_emplace(header.worker, header.epoch);
}

// Whether those who do the step together knew of this worker when they published what it begins with. It can listen only then.
bool LockstepExchange::all_know_this() const {
    const auto& epoch = publisher_.at(replica_.step()).epoch;
    return std::ranges::all_of(epoch, [this](const auto& of) { return of.second >= member_since_; });
}

std::vector<std::uint32_t> LockstepExchange::publishers(std::uint64_t step) const {
    const auto of = publisher_.find(step);
    if (of == publisher_.end()) return {};
    std::vector<std::uint32_t> all = of->second.of;
    std::ranges::sort(all);
    all.erase(std::ranges::unique(all).begin(), all.end());
    std::erase(all, kApplication);
    return all;
}

void LockstepExchange::take(const MessageHeader& header, PartMessage&& message) {
    // Others may be in the next step already; nobody waits for one that owns nothing.
    constexpr std::uint64_t kFollows = 16;
    const std::uint64_t now = replica_.step();
    if (header.step < now || header.step > now + (owns_any() ? 1 : kFollows)) return;
    std::deque<Part>& parts = parts_[header.worker];
    while (!parts.empty() && parts.front().step < now) parts.pop_front();
    if (parts.size() < most_parts_) {
        // Parts of one step come one way, in order; those of the next may overtake them on another.
        const auto later = std::ranges::upper_bound(parts, header.step, {}, &Part::step);
        parts.insert(later, {header.step, message.gave_up, std::move(message.bytes)});
    } else {
        parts.assign(1, {header.step, true, {}});  // it tells what nobody needs
    }
}

void LockstepExchange::members(const Members& message, std::uint32_t epoch) {
    const std::vector<std::uint32_t>& workers = message.workers;
    if (!member_since_) member_since_ = epoch;
    others_ = workers;
    std::erase(others_, self_);
    std::erase_if(parts_,
                  [&](const auto& of) { return std::ranges::find(workers, of.first) == workers.end(); });
}

void LockstepExchange::members_within(const std::vector<std::uint32_t>& workers) {
    if (workers.empty()) wait_for_none();
    look_for_lost(workers);
}

void LockstepExchange::look_for_lost(const std::vector<std::uint32_t>& workers) {
    partner_lost_ = partner_lost_ || std::ranges::any_of(partners_, [&](std::uint32_t partner) {
                        return partner != self_ && std::ranges::find(workers, partner) == workers.end();
                    });
}

// What came of waiting, or of what others told, may come of it again.
void LockstepExchange::wait_for_none() {
    alone_until_ = replica_.step() + kStepsAlone;
}

void LockstepExchange::tell(const StepChannel& channel, std::vector<std::uint32_t> to, bool gave_up,
                            std::vector<std::uint8_t>&& bytes) {
    if (!to.empty())
        send_(std::move(to), encode({self_, 0, replica_.step()}, PartMessage{gave_up, std::move(bytes)}),
              false);
    if (channel.flush) channel.flush(false);
}

std::vector<std::uint8_t> LockstepExchange::hear(const StepChannel& channel, std::uint32_t from) {
    const std::uint64_t now = replica_.step();
    for (;;) {
        for (const std::uint32_t partner : partners_) {
            std::deque<Part>& parts = parts_[partner];
            while (!parts.empty() && parts.front().step < now) parts.pop_front();
            if (std::ranges::any_of(parts, [now](const Part& p) { return p.gave_up && p.step == now; }))
                throw NotTogether("worker " + std::to_string(partner) + " gave up");
        }
        if (partner_lost_) throw NotTogether("a worker is lost");
        std::deque<Part>& parts = parts_[from];
        if (!parts.empty() && parts.front().step == now) {
            std::vector<std::uint8_t> bytes = std::move(parts.front().bytes);
            parts.pop_front();
            return bytes;
        }
        channel.flush(true);
    }
}

// Whether the step was done so.
bool LockstepExchange::step_together(const StepChannel& channel) {
    partners_ = publishers(replica_.step());
    const auto self = std::ranges::find(partners_, self_);
    const bool listens = self == partners_.end();
    if (!may_together_ || partners_.size() < 2) return false;
    partner_lost_ = false;
    look_for_lost(others_);
    try {
        if (!channel.flush || partner_lost_ || replica_.step() < alone_until_ ||
            (listens && !all_know_this()))
            throw NotTogether("this one cannot");
        std::vector<int> of;
        for (const std::uint32_t publisher : publisher_[replica_.step()].of) {
            const auto at = std::ranges::find(partners_, publisher);
            of.push_back(at == partners_.end() ? 0 : static_cast<int>(at - partners_.begin()));
        }
        Together together(*this, channel, listens ? -1 : static_cast<int>(self - partners_.begin()),
                          std::move(of));
        replica_.world().step_together(together);
        return true;
    } catch (const NotTogether&) {
    } catch (const DecodeError&) {  // of a part that is none
        wait_for_none();
    }
    if (!listens) tell(channel, others_, true, {});
    return false;
}

void LockstepExchange::take(SnapshotMessage&& message) {
    replica_.jump(message.snapshot);
    settle();
}

void LockstepExchange::own(const Ownership& ownership, std::uint32_t) {
    std::vector<std::uint32_t> bodies;
    for (const WorldRecord& record : ownership.bodies) {
        bodies.push_back(static_cast<std::uint32_t>(record.body));
        owner_[bodies.back()] = ownership.owner;
        if (ownership.owner != self_) set_own(record.body, false);
    }
    replica_.mark(ownership.step, bodies);
    if (ownership.owner == self_) later_.push_back(ownership);
    settle();
}

void LockstepExchange::take_over(const Ownership& ownership) {
    if (ownership.step + 1 < replica_.step() || (ownership.step < replica_.step() && replica_.whole()))
        throw DecodeError("found bodies of step " + std::to_string(ownership.step) + ", expected step " +
                          std::to_string(replica_.step()));
    for (const WorldRecord& record : ownership.bodies)
        if (owner_[static_cast<std::size_t>(record.body)] == self_) set_own(record.body, true);
    owes_ = owes_ || ownership.step < replica_.step();
}

// Takes whatever has become possible: ownership of this step, a whole step.
void LockstepExchange::settle() {
    if (unpublished_) return;
    publisher_.erase(publisher_.begin(), publisher_.lower_bound(replica_.step()));
    for (bool changed = true; changed;) {
        changed = false;
        for (std::size_t i = 0; i < later_.size(); ++i) {
            if (later_[i].step > replica_.step()) continue;
            const Ownership ownership = std::move(later_[i]);
            later_.erase(later_.begin() + static_cast<std::ptrdiff_t>(i));
            take_over(ownership);
            changed = true;
            break;
        }
        list_owned();
        changed = replica_.advance(!owns_any() && !done()) || changed;
    }
}

void LockstepExchange::follow() {
    settle();
}

bool LockstepExchange::ready() const {
    if (!replica_.whole() || done()) return false;
    if (owns_any()) return true;
    // The others wait for one that has given away all that it had, too.
    const std::vector<std::uint32_t> partners = publishers(replica_.step());
    return replica_.misses_records() || std::ranges::find(partners, self_) != partners.end();
}

void LockstepExchange::step(const StepChannel& channel) {
    World& world = replica_.world();
    replica_.begin();
    for (int i = 0; i < world.bodies(); ++i) world.set_own(i, own_[static_cast<std::size_t>(i)] != 0);
    list_owned();
    const bool together = step_together(channel);
    was_alone_ = !together && partners_.size() > 1;
    if (!together) {
        Alone alone;
        world.step_together(alone);
    }
    replica_.stepped();
    publisher_.erase(publisher_.begin(), publisher_.lower_bound(replica_.step()));
    unpublished_ = true;
}

void LockstepExchange::publish(std::uint32_t epoch, const StepReport& report) {
    const World& world = replica_.world();
    auto& states = std::get<StateMessage>(outgoing_);
    states.report = report;
    states.bodies.resize(owned_.size());
    std::vector<std::uint32_t> bodies(owned_.begin(), owned_.end());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        world.record(owned_[i], states.bodies[i]);
        note_publisher({self_, epoch, replica_.step()}, bodies[i]);
    }
    world.contact_records(states.contacts);
    world.spring_records(states.springs);
    replica_.mark(replica_.step(), bodies);
    unpublished_ = owes_ = false;
    send_({}, encode({self_, epoch, replica_.step()}, outgoing_), true);
    settle();
}

Holdings LockstepExchange::holdings() {
    const World& world = replica_.world();
    return columns_.holdings(self_, world, owner_, costs_,
                             [&](int body) { return world.state(body).position; });
}

Handover LockstepExchange::give(const std::vector<std::uint32_t>& bodies) {
    Handover handover;
    for (const std::uint32_t id : bodies) {
        const int body = static_cast<int>(id);
        handover.bodies.push_back(replica_.world().record(body));
        set_own(body, false);
    }
    // A body that is given counts as published by this worker until it is registered elsewhere.
    list_owned();
    return handover;
}

}  // namespace

std::size_t most_parts(const WorldScene& scene) {
    // Of an island that is shared out, in a substep, see IslandSolver::substep, and in the step besides; of all islands.
    constexpr std::size_t kOfSubstep = 18, kOfIsland = 2, kOfStep = 128;
    const std::size_t bodies = scene.world.bodies.size() + scene.later.size(),
                      substeps = static_cast<std::size_t>(scene.world.settings.substeps);
    return kOfStep + (kOfIsland + kOfSubstep * substeps) * (1 + bodies / kLeastDivided);
}

std::unique_ptr<ReplicaProtocol> make_lockstep_exchange(const SceneMessage& scene) {
    return std::make_unique<LockstepExchange>(scene);
}

}  // namespace sim
