#include <algorithm>
#include <deque>

#include "shared/body_costs.h"
#include "shared/replica.h"
#include "shared/replica_protocol.h"

namespace sim {
namespace {

// Every worker has a whole replica. A step from t to t + 1 needs every body's exact record at t. The worker
// solves each island with an own body, publishes own records at t + 1, and is at t + 1 when the others' are
// there.
//
// Ownership comes with a record at some step s, the last that was published. Nobody can be further than
// s + 1, and a worker that is already there waits for these bodies:
//   s = own step        they are own from here on
//   s = own step - 1    the step is undone and repeated with them; the other bodies get the same bits again
//   s > own step        waits until this worker is there
class LockstepExchange final : public ReplicaProtocol {
public:
    explicit LockstepExchange(const SceneMessage& scene);

    using ReplicaProtocol::take;
    void take(const WorldHeader& header, StateMessage&& message) override;
    void take(SnapshotMessage&& message) override;
    void members(const std::vector<std::uint32_t>& workers) override { (void)workers; }
    void own(const Ownership& ownership) override;
    [[nodiscard]] bool ready() const override;
    void step() override;
    [[nodiscard]] std::vector<std::uint8_t> publish(std::uint32_t epoch, const StepReport& report) override;
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
    [[nodiscard]] const World& world() const override { return replica_.world(); }

private:
    void set_own(int body, bool own);
    void take_over(const Ownership& ownership);
    void settle();
    void list_owned();

    std::uint32_t self_;
    std::uint64_t steps_;
    Replica replica_;
    BodyCosts costs_;
    ColumnWatch columns_;
    std::vector<std::uint32_t> owner_;     // as registered
    std::vector<std::uint8_t> own_;        // now; with bodies that come in the next step
    std::vector<int> owned_;               // that are there, ascending
    std::deque<Ownership> later_;          // own ones of later steps
    bool unpublished_ = false;             // between step() and publish()
    WorldSnapshot before_;                 // of the last step, after its events
    std::vector<std::uint8_t> published_;  // what was own in the last step
    std::vector<SpringRecord> springs_;    // published of the last step
};

LockstepExchange::LockstepExchange(const SceneMessage& scene)
    : self_(scene.worker),
      steps_(scene.settings.steps),
      replica_(scene.scene),
      costs_(replica_.clock().bodies()),
      columns_(scene.scene) {
    owner_.assign(static_cast<std::size_t>(replica_.clock().bodies()), kApplication);
    own_.assign(owner_.size(), 0);
    published_ = own_;
}

void LockstepExchange::list_owned() {
    owned_.clear();
    for (int i = 0; i < replica_.world().bodies(); ++i)
        if (own_[static_cast<std::size_t>(i)] != 0) owned_.push_back(i);
}

void LockstepExchange::set_own(int body, bool own) {
    own_[static_cast<std::size_t>(body)] = own;
    if (body < replica_.world().bodies()) replica_.world().set_own(body, own);
    if (own) costs_.forget(body);
}

void LockstepExchange::take(const WorldHeader& header, StateMessage&& message) {
    replica_.note(header.step, std::move(message.bodies), std::move(message.contacts),
                  std::move(message.springs));
    settle();
}

void LockstepExchange::take(SnapshotMessage&& message) {
    replica_.jump(message.snapshot);
    settle();
}

void LockstepExchange::own(const Ownership& ownership) {
    for (const WorldRecord& record : ownership.bodies) {
        owner_[static_cast<std::size_t>(record.body)] = ownership.owner;
        if (ownership.owner != self_) set_own(record.body, false);
    }
    std::vector<WorldRecord> records = ownership.bodies;
    replica_.note(ownership.step, std::move(records), {}, {});
    if (ownership.owner == self_) later_.push_back(ownership);
    settle();
}

void LockstepExchange::take_over(const Ownership& ownership) {
    if (ownership.step + 1 == replica_.step() && !replica_.whole())
        replica_.undo(before_, published_, springs_);
    if (ownership.step != replica_.step())
        throw DecodeError("found bodies of step " + std::to_string(ownership.step) + ", expected step " +
                          std::to_string(replica_.step()));
    for (const WorldRecord& record : ownership.bodies) set_own(record.body, true);
}

// Takes whatever has become possible: ownership of this step, a whole step.
void LockstepExchange::settle() {
    if (unpublished_) return;
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
        const bool owner = std::find(own_.begin(), own_.end(), 1) != own_.end();
        changed = replica_.advance(!owner && !done()) || changed;
    }
}

void LockstepExchange::follow() {
    settle();
}

bool LockstepExchange::ready() const {
    return replica_.whole() && !done() && std::find(own_.begin(), own_.end(), 1) != own_.end();
}

void LockstepExchange::step() {
    World& world = replica_.world();
    replica_.begin();
    for (int i = 0; i < world.bodies(); ++i) world.set_own(i, own_[static_cast<std::size_t>(i)] != 0);
    list_owned();
    before_ = world.snapshot();
    world.step();
    published_ = own_;
    replica_.stepped(published_);
    unpublished_ = true;
}

std::vector<std::uint8_t> LockstepExchange::publish(std::uint32_t epoch, const StepReport& report) {
    const World& world = replica_.world();
    StateMessage message;
    message.report = report;
    message.bodies.reserve(owned_.size());
    for (const int body : owned_) message.bodies.push_back(world.record(body));
    world.contact_records(message.contacts);
    world.spring_records(message.springs);
    springs_ = message.springs;
    std::vector<std::uint8_t> bytes = encode({self_, epoch, replica_.step()}, message);
    unpublished_ = false;
    settle();
    return bytes;
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

std::unique_ptr<ReplicaProtocol> make_lockstep_exchange(const SceneMessage& scene) {
    return std::make_unique<LockstepExchange>(scene);
}

}  // namespace sim
