#include <algorithm>
#include <cmath>
#include <numeric>

#include "shared/body_costs.h"
#include "shared/ghosts.h"
#include "shared/replica.h"
#include "shared/replica_protocol.h"

namespace sim {
namespace {

// Every worker is at a step of its own. Its world holds its bodies; of the others' bodies those that may come
// near are put in as ghosts for each step.
//
// A contact between an own body and a ghost is resolved by the owner of the lower number: one owner, so one
// resolver. The impulse on the ghost is published as a push, in the same message as the states that result
// from it: either both arrive or neither. The ghost's owner holds the push over the same step if it arrives
// in time; otherwise it holds the lasting part of the two steps before (ImpulseLog), and corrects by the
// difference when the push arrives. So every impulse arrives exactly once and momentum is kept. `applied`
// says which pushes a state includes; every reader of a ghost corrects it by the pushes that it
// knows.
class BoundedExchange final : public ReplicaProtocol {
public:
    explicit BoundedExchange(const SceneMessage& scene);

    using ReplicaProtocol::take;
    void take(const WorldHeader& header, PackedUpdates&& message) override;
    void take(SnapshotMessage&& message) override;
    void members(const std::vector<std::uint32_t>& workers) override;
    void own(const Ownership& ownership) override;
    [[nodiscard]] bool ready() const override;
    void step() override;
    [[nodiscard]] std::vector<std::uint8_t> publish(std::uint32_t epoch, const StepReport& report) override;
    void follow() override;
    [[nodiscard]] std::vector<Lot> lots(std::uint32_t towards) const override;
    [[nodiscard]] Handover give(const std::vector<std::uint32_t>& bodies) override;
    void cost(double seconds) override { costs_.share(seconds, world_, owned_); }
    [[nodiscard]] std::uint64_t steps_done() const override { return step_; }
    [[nodiscard]] bool at_end() const override { return step_ >= settings_.steps; }
    [[nodiscard]] bool done() const override { return at_end() && settled_; }
    [[nodiscard]] int own_bodies() const override { return static_cast<int>(owned_.size()); }
    [[nodiscard]] int lead() const override;
    [[nodiscard]] int ghost_age() const override { return ghost_age_; }
    [[nodiscard]] const World& world() const override { return world_; }

private:
    struct Felt {  // what other bodies of this worker did to an own one in the last two steps
        StepImpulse last, before;
    };
    void come_to(std::uint64_t step);
    void list();
    void set_own(int body, bool own);
    void take_over(const Ownership& ownership);
    void take_due();
    void put_right();
    void hold_pushes();
    void place_ghosts();
    void keep_pushes();
    void give_push(int ghost, const StepImpulse& impulse);
    [[nodiscard]] int resolvers(int own, int ghost) const;
    void feel();
    void settle();
    [[nodiscard]] std::uint64_t slowest() const;
    [[nodiscard]] bool owns_any(std::uint32_t worker) const;
    void applied(std::vector<std::uint32_t>& sources, std::vector<std::uint64_t>& steps) const;
    [[nodiscard]] Update update_of(int body) const;

    std::uint32_t self_;
    DistributedSettings settings_;
    World world_;
    SceneClock clock_;
    BodyCosts costs_;
    ImpulseLog pushes_;
    Ghosts foreign_;
    std::uint64_t step_ = 0;
    std::vector<int> lot_;              // of each body: lowest number of those that constraints tie it to
    std::vector<std::uint32_t> owner_;  // as registered
    std::vector<std::uint8_t> own_;
    std::vector<int> owned_, others_;  // there, ascending; moving ones of others
    std::vector<std::uint32_t> members_;
    std::map<std::uint32_t, std::uint64_t> applied_;  // pushes that own states include
    std::vector<Ownership> later_;
    std::vector<ForeignBall> balls_;
    std::vector<int> near_;
    std::vector<int> leant_on_;                      // ghosts of this step that others hold, too
    std::vector<Push> given_;                        // in the last step
    std::vector<std::uint32_t> breakable_, broken_;  // constraints; those that broke in the last step
    std::map<std::pair<int, int>, CrossImpulse> crossed_;
    std::map<int, Felt> felt_;
    std::vector<std::uint8_t> told_asleep_;
    std::map<std::uint32_t, std::uint64_t>
        touched_;  // workers: step of the last push between their bodies and own ones
    int ghost_age_ = 0;
    bool settled_ = false;
};

constexpr int kMostBound = 64;
constexpr std::uint64_t kTouchingLead = 1, kTouchingSteps = 4;

// From what was towards what is, by a share; displacement and turn are pushes out of overlaps, which do not
// last.
void blend(const StepImpulse& before, double share, StepImpulse& now) {
    const Eigen::Vector3d displacement = share * now.displacement, turn = share * now.turn;
    add_impulse(now, now, share - 1);
    add_impulse(now, before, 1 - share);
    now.displacement = displacement, now.turn = turn;
}

int keep_steps(int bound) {
    return 4 * std::min(bound, kMostBound) + 16;
}

// Bodies that constraints tie together, now or later: the lowest number of each such group.
std::vector<int> tied(const WorldScene& scene, int bodies) {
    std::vector<int> root(static_cast<std::size_t>(bodies));
    std::iota(root.begin(), root.end(), 0);
    auto find = [&root](int i) {
        while (root[static_cast<std::size_t>(i)] != i) i = root[static_cast<std::size_t>(i)];
        return i;
    };
    auto fixed = [&scene](int i) { return !scene.world.bodies[static_cast<std::size_t>(i)].moves(); };
    for (const PointConstraint& c : scene.world.constraints) {
        if (c.body_b < 0 || fixed(c.body_a) || fixed(c.body_b)) continue;
        const int a = find(c.body_a), b = find(c.body_b);
        root[static_cast<std::size_t>(std::max(a, b))] = std::min(a, b);
    }
    for (int i = 0; i < bodies; ++i) root[static_cast<std::size_t>(i)] = find(i);
    return root;
}

BoundedExchange::BoundedExchange(const SceneMessage& scene)
    : self_(scene.worker),
      settings_(scene.settings),
      world_(scene.scene.world),
      clock_(scene.scene),
      costs_(clock_.bodies(), scene.settings.market.smoothing_steps),
      pushes_(world_, clock_.bodies(), keep_steps(scene.settings.bound)),
      foreign_(world_, pushes_, self_, clock_.bodies(), settings_.bound),
      lot_(tied(scene.scene, clock_.bodies())) {
    const auto n = static_cast<std::size_t>(clock_.bodies());
    owner_.assign(n, kApplication), own_.assign(n, 0), told_asleep_.assign(n, 0);
    for (std::size_t c = 0; c < scene.scene.world.constraints.size(); ++c)
        if (std::isfinite(scene.scene.world.constraints[c].breaking_force))
            breakable_.push_back(static_cast<std::uint32_t>(c));
    world_.share(Sharing::pairs);
    for (int i = 0; i < world_.bodies(); ++i) {
        if (!clock_.moves(i)) continue;
        world_.set_own(i, false);
        foreign_.take_own(i, 0, {}, {});
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
        if (clock_.moves(i) && !own && !foreign_.known(i)) foreign_.take_own(i, step, {}, {});
    }
    if (world_.bodies() != before) list();
}

void BoundedExchange::take(const WorldHeader& header, PackedUpdates&& message) {
    const auto shared = std::make_shared<const PackedUpdates>(std::move(message));
    pushes_.add(header.worker, header.step, shared);
    pushes_.heard(header.worker, header.step);
    foreign_.take(header.step, shared);
    for (const PackedUpdates::Place& push : shared->pushes)
        if (push.body < own_.size() && own_[push.body] != 0)
            touched_[header.worker] = std::max(step_, header.step);
    for (const std::uint32_t constraint : shared->broken)
        world_.remove_constraint(static_cast<int>(constraint));
}

// Bodies follow with their owners.
void BoundedExchange::take(SnapshotMessage&& message) {
    world_.restore_contacts({}, message.snapshot.springs);
    come_to(message.snapshot.step);
}

void BoundedExchange::members(const std::vector<std::uint32_t>& workers) {
    for (const std::uint32_t was : members_)
        if (std::find(workers.begin(), workers.end(), was) == workers.end())
            pushes_.heard(was, ImpulseLog::kForever);
    members_ = workers;
}

void BoundedExchange::own(const Ownership& ownership) {
    const std::uint32_t owner = ownership.owner;
    const bool first = std::find(owner_.begin(), owner_.end(), owner) == owner_.end();
    UpdateMessage message;
    message.sources = ownership.sources, message.applied = ownership.applied;
    for (const WorldRecord& record : ownership.bodies) {
        owner_[static_cast<std::size_t>(record.body)] = owner;
        Update& update = message.bodies.emplace_back();
        update.body = static_cast<std::uint32_t>(record.body);
        update.asleep = record.asleep, update.quarantined = record.quarantined;
        update.state = record.state;
        if (owner != self_ && own_[static_cast<std::size_t>(record.body)] != 0) set_own(record.body, false);
    }
    // A worker that owned nothing begins here.
    if (first && owner != self_) pushes_.heard(owner, ownership.step);
    // State as last published: members already have that message, with the forces that held the bodies.
    std::erase_if(message.bodies, [&](const Update& u) {
        return !ownership.traded && foreign_.newest(static_cast<int>(u.body)) >= ownership.step;
    });
    foreign_.take(ownership.step, message);
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
    put_right();
    for (const WorldRecord& record : ownership.bodies) {
        const int body = record.body;
        if (owner_[static_cast<std::size_t>(body)] != self_) continue;  // gone again
        if (body < world_.bodies()) {
            WorldRecord now = record;
            const Ghosts::Ghost ghost = foreign_.at(body, step_);
            now.state = ghost.state;
            now.asleep = now.asleep && ghost.asleep;
            set_own(body, true);
            world_.restore(now);
        } else {
            set_own(body, true);
        }
    }
    list();
}

bool BoundedExchange::owns_any(std::uint32_t worker) const {
    return std::find(members_.begin(), members_.end(), worker) != members_.end() &&
           std::find(owner_.begin(), owner_.end(), worker) != owner_.end();
}

std::uint64_t BoundedExchange::slowest() const {
    std::uint64_t slowest = ImpulseLog::kForever;
    for (const std::uint32_t worker : members_) {
        if (worker == self_ || !owns_any(worker)) continue;
        slowest = std::min(slowest, pushes_.known(worker));
    }
    return slowest;
}

int BoundedExchange::lead() const {
    const std::uint64_t least = slowest();
    return least < step_ ? static_cast<int>(step_ - least) : 0;
}

bool BoundedExchange::ready() const {
    if (owned_.empty()) return false;
    if (at_end()) return !settled_ && slowest() >= settings_.steps;
    if (lead() > settings_.bound) return false;
    // Bodies that touch across workers hold each other up by what was: the older, the less steady.
    return std::all_of(touched_.begin(), touched_.end(), [this](const auto& t) {
        return t.second + kTouchingSteps < step_ || !owns_any(t.first) ||
               pushes_.known(t.first) + kTouchingLead >= step_;
    });
}

// Pushes that came since: what was assumed of steps that are over is put right.
void BoundedExchange::put_right() {
    StepImpulse scratch;
    for (const auto& [source, known] : pushes_.sources()) {
        std::uint64_t& then = applied_[source];
        if (source == self_ || known <= then) continue;
        for (const int body : owned_) {
            if (pushes_.quiet(body) || then >= step_) continue;
            for (std::uint64_t step = pushes_.first_kept(then + 1, step_); step <= step_; ++step) {
                const int ago = static_cast<int>(step_ - step);
                if (const StepImpulse* right = pushes_.seen(body, source, step, known, scratch))
                    world_.correct(body, *right, ago);
                if (const StepImpulse* wrong = pushes_.seen(body, source, step, then, scratch))
                    world_.correct(body, *wrong, ago, -1);
            }
        }
        then = known;
    }
}

void BoundedExchange::hold_pushes() {
    StepImpulse scratch;
    for (const int body : owned_) {
        if (pushes_.quiet(body)) continue;
        StepImpulse held;
        bool any = false;
        for (const std::uint32_t source : pushes_.sources_of(body))
            if (source != self_)
                if (const StepImpulse* push =
                        pushes_.seen(body, source, step_ + 1, applied_[source], scratch))
                    add_steady(held, *push), any = true;
        if (any) world_.hold(body, held);
    }
}

void BoundedExchange::place_ghosts() {
    balls_.clear();
    for (const int body : others_)
        if (foreign_.known(body) && !foreign_.quarantined(body)) balls_.push_back(foreign_.ball(body, step_));
    world_.near_own(balls_, near_);
    ghost_age_ = 0;
    leant_on_.clear();
    for (const int body : near_) {
        const Ghosts::Ghost ghost = foreign_.at(body, step_);
        if (!world_.is_near_own(body, ghost.state)) continue;
        ghost_age_ = std::max(ghost_age_, ghost.age);
        if (ghost.leant_on) leant_on_.push_back(body);
        world_.place_ghost(body, ghost.state, is_zero(ghost.held) ? nullptr : &ghost.held, ghost.asleep);
    }
}

// What is given to ghosts. Several workers may resolve contacts of one body in the same step, each against
// what the others did before; all together would overdo it and swing. So a contact that lasts changes by its
// share only: one in as many as work on either body.
void BoundedExchange::keep_pushes() {
    given_.clear();
    std::map<std::pair<int, int>, CrossImpulse> now;
    for (CrossImpulse cross : world_.cross_impulses()) {
        if (!is_finite(cross.on_ghost) || !is_finite(cross.on_own)) continue;  // of a body that is broken
        const auto before = crossed_.find({cross.own, cross.ghost});
        const double share = 1.0 / resolvers(cross.own, cross.ghost);
        if (before != crossed_.end() && share < 1) {
            world_.correct(cross.own, cross.on_own, 0, -1);
            blend(before->second.on_own, share, cross.on_own);
            blend(before->second.on_ghost, share, cross.on_ghost);
            world_.correct(cross.own, cross.on_own, 0);
        }
        give_push(cross.ghost, cross.on_ghost);
        touched_[owner_[static_cast<std::size_t>(cross.ghost)]] = step_;
        now.emplace(std::pair(cross.own, cross.ghost), std::move(cross));
    }
    crossed_ = std::move(now);
    // As they travel: all but linear and angular as floats.
    for (Push& push : given_) {
        StepImpulse& sent = push.impulse;
        sent.modal_q = sent.modal_q.cast<float>().cast<double>();
        sent.modal_rate = sent.modal_rate.cast<float>().cast<double>();
        world_.spread_modes(static_cast<int>(push.body), sent);
        sent.displacement = sent.displacement.cast<float>().cast<double>();
        sent.turn = sent.turn.cast<float>().cast<double>();
        pushes_.add(static_cast<int>(push.body), self_, step_, sent);
    }
    pushes_.heard(self_, step_);
}

void BoundedExchange::give_push(int ghost, const StepImpulse& impulse) {
    for (Push& push : given_)
        if (push.body == static_cast<std::uint32_t>(ghost)) return add_impulse(push.impulse, impulse);
    given_.push_back({static_cast<std::uint32_t>(ghost), impulse});
}

int BoundedExchange::resolvers(int own, int ghost) const {
    const auto recent = static_cast<std::uint64_t>(settings_.bound) + 3;
    const std::uint64_t since = step_ > recent ? step_ - recent : 0;
    const bool leant_on = std::find(leant_on_.begin(), leant_on_.end(), ghost) != leant_on_.end();
    return 1 + std::max(pushes_.count_since(own, since, self_),
                        pushes_.count_since(ghost, since, self_) + (leant_on ? 1 : 0));
}

// Of bodies that others push, what own ones do to them: others want to know what holds the ghost.
void BoundedExchange::feel() {
    for (const int body : owned_) {
        const bool pushed = !pushes_.quiet(body);
        world_.watch(body, pushed);
        if (!pushed) {
            felt_.erase(body);
            continue;
        }
        Felt& felt = felt_[body];
        std::swap(felt.before, felt.last);
        if (const StepImpulse* now = world_.impulse(body))
            felt.last = *now;
        else
            felt.last = {};
    }
}

// After the last step: pushes that came late. Nobody will hear of these states but the application.
void BoundedExchange::settle() {
    put_right();
    std::fill(told_asleep_.begin(), told_asleep_.end(), std::uint8_t{0});
    settled_ = true;
}

void BoundedExchange::step() {
    if (at_end()) return settle();
    come_to(step_);
    put_right();
    hold_pushes();
    place_ghosts();
    std::vector<std::uint32_t> breakable;
    for (const std::uint32_t c : breakable_)
        if (world_.constraint_holds(static_cast<int>(c))) breakable.push_back(c);
    world_.step();
    ++step_;
    for (const std::uint32_t c : breakable)
        if (!world_.constraint_holds(static_cast<int>(c))) broken_.push_back(c);
    keep_pushes();
    feel();
    pushes_.prune(step_);
    take_due();
}

void BoundedExchange::applied(std::vector<std::uint32_t>& sources, std::vector<std::uint64_t>& steps) const {
    for (const auto& [source, known] : applied_) {
        if (source == self_) continue;
        sources.push_back(source), steps.push_back(known);
    }
    sources.push_back(self_), steps.push_back(step_);
}

Update BoundedExchange::update_of(int body) const {
    const WorldRecord record = world_.record(body);
    Update update;
    update.body = static_cast<std::uint32_t>(body);
    update.asleep = record.asleep, update.quarantined = record.quarantined;
    update.still = record.asleep || record.still_steps * world_.settings().dt >= 0.5 - 1e-9;
    update.state = record.state;
    if (const auto felt = felt_.find(body); felt != felt_.end()) {
        lasting(felt->second.last, felt->second.before, update.impulse);
        update.held = !is_zero(update.impulse);
    }
    return update;
}

std::vector<std::uint8_t> BoundedExchange::publish(std::uint32_t epoch, const StepReport& report) {
    UpdateMessage message;
    message.report = report;
    applied(message.sources, message.applied);
    for (const int body : owned_) {
        std::uint8_t& told = told_asleep_[static_cast<std::size_t>(body)];
        const bool asleep = world_.asleep(body);
        if (asleep && told != 0) continue;
        told = asleep;
        message.bodies.push_back(update_of(body));
    }
    message.pushes = std::move(given_);
    given_.clear();
    message.broken = std::move(broken_);
    broken_.clear();
    return encode({self_, epoch, step_}, message);
}

std::vector<ReplicaProtocol::Lot> BoundedExchange::lots(std::uint32_t towards) const {
    std::vector<int> others;
    for (const int i : others_)
        if (owner_[static_cast<std::size_t>(i)] == towards) others.push_back(i);
    Eigen::Vector3d theirs = Eigen::Vector3d::Zero();
    for (const int i : others) theirs += foreign_.last_position(i) / static_cast<double>(others.size());
    const std::vector<double> pull = pulls(world_, owned_, others);
    std::map<int, Lot> lots;
    for (std::size_t i = 0; i < owned_.size(); ++i) {
        const int body = owned_[i];
        Lot& lot = lots.try_emplace(lot_[static_cast<std::size_t>(body)], Lot{{}, 0, -1e300}).first->second;
        lot.bodies.push_back(static_cast<std::uint32_t>(body));
        const bool known = costs_.of(body) >= 0 && lot.cost_s >= 0;
        lot.cost_s = known ? lot.cost_s + costs_.of(body) : -1;
        lot.pull = std::max(lot.pull, pull[i]);
    }
    std::vector<Lot> all;
    for (auto& [first, lot] : lots)
        if (lot.cost_s > 0) all.push_back(std::move(lot));
    return all;
}

Handover BoundedExchange::give(const std::vector<std::uint32_t>& bodies) {
    put_right();
    Handover handover;
    applied(handover.sources, handover.applied);
    for (const std::uint32_t id : bodies) {
        const int body = static_cast<int>(id);
        handover.bodies.push_back(world_.record(body));
        foreign_.take_own(body, step_, handover.sources, handover.applied);
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
