#include "world/shared_world.h"

#include <algorithm>
#include <cmath>

#include "world/world_implementation.h"

namespace sim {
namespace {

void push(MovingBody& body, double dt, const StepImpulse& impulse) {
    if (!std::exchange(body.pushed, true))
        body.force.setZero(), body.torque.setZero(), body.modal_force.setZero();
    body.force += impulse.linear / dt;
    body.torque += impulse.angular / dt;
    if (impulse.modal.size() == body.modal_force.size()) body.modal_force += impulse.modal / dt;
}

}  // namespace

void World::Implementation::gather_shared() {
    std::sort(placed.begin(), placed.end());
    participants.clear();
    std::merge(owned.begin(), owned.end(), placed.begin(), placed.end(), std::back_inserter(participants));
    std::erase_if(participants, [this](int i) { return bodies[static_cast<std::size_t>(i)].quarantined; });
}

void World::Implementation::dismiss_ghosts() {
    for (const int i : placed) bodies[static_cast<std::size_t>(i)].pushed = false;
    placed.clear();
    for (const int i : arrived) bodies[static_cast<std::size_t>(i)].arrived = false;
    arrived.clear();
}

SharedWorld::SharedWorld(const WorldDefinition& definition) : World(definition) {
    implementation_->shared = true;
    implementation_->list_owned();
}

void World::Implementation::list_owned() {
    owned.clear();
    if (!shared) return;
    for (std::size_t i = 0; i < bodies.size(); ++i)
        if (bodies[i].own || bodies[i].fixed) owned.push_back(static_cast<int>(i));
}

void SharedWorld::set_own(int body, bool own) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    if (b.own == own) return;
    b.own = own;
    implementation_->all_whole = false;
    b.watched = b.was_given = b.pushed = false;
    b.arrived = own;
    if (own) implementation_->arrived.push_back(body);
    implementation_->list_owned();
}

bool SharedWorld::own(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).own;
}

WorldRecord SharedWorld::record(int body) const {
    WorldRecord record;
    this->record(body, record);
    return record;
}

void SharedWorld::record(int body, WorldRecord& out) const {
    implementation_->record(body, out);
}

void SharedWorld::restore(const WorldRecord& record) {
    implementation_->restore(record);
}

void SharedWorld::set_step(std::uint64_t step) {
    implementation_->set_step(step);
}

int SharedWorld::cross_contacts() const noexcept {
    return implementation_->cross_contacts;
}

double SharedWorld::work(int body) const {
    return implementation_->bodies.at(static_cast<std::size_t>(body)).work;
}

double SharedWorld::most_radius(int body) const {
    const BodyKind& kind = *implementation_->bodies.at(static_cast<std::size_t>(body)).kind;
    return kind.surface.bounding_radius() * (kind.modes > 0 ? 1 + kGradientLimit : 1);
}

double SharedWorld::radius_now(int body) const {
    const MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    return loose_radius(*b.kind, b.state.q);
}

bool World::Implementation::near_own(const Eigen::Vector3d& center, double radius) const {
    return std::any_of(own_balls.begin(), own_balls.end(), [&](const Ball& ball) {
        const double reach = ball.radius + radius;
        return (ball.center - center).squaredNorm() <= reach * reach;
    });
}

void SharedWorld::near_own(const std::vector<ForeignBall>& foreign, std::vector<int>& near) {
    Implementation& w = *implementation_;
    w.own_balls.clear();
    Eigen::AlignedBox3d all;
    for (const int i : w.owned) {
        const MovingBody& body = w.bodies[static_cast<std::size_t>(i)];
        if (!body.moves()) continue;
        const double radius = loose_radius(*body.kind, body.state.q) + contact_reach(body, w.settings);
        w.own_balls.push_back({body.state.position, radius});
        all.extend((body.state.position.array() - radius).matrix());
        all.extend((body.state.position.array() + radius).matrix());
    }
    near.clear();
    for (const ForeignBall& ball : foreign)
        if (all.squaredExteriorDistance(ball.center) <= ball.radius * ball.radius &&
            w.near_own(ball.center, ball.radius))
            near.push_back(ball.body);
}

bool SharedWorld::is_near_own(int body, const WorldBodyState& state) const {
    const MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    const WorldSettings& settings = implementation_->settings;
    double speed =
        state.velocity.norm() + settings.dt * std::abs(b.gravity_scale) * settings.gravity.norm() +
        state.angular_momentum.norm() / b.kind->mass.inertia.minCoeff() * b.kind->surface.bounding_radius();
    if (b.kind->modes > 0) speed += b.kind->shape_bound.dot(state.q_dot.cwiseAbs());
    return implementation_->near_own(state.position,
                                     loose_radius(*b.kind, state.q) * 1.01 + settings.dt * speed);
}

void SharedWorld::place_ghost(int body, const WorldBodyState& state, const StepImpulse* held, bool asleep) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    b.state = state;
    b.asleep = asleep;
    b.sleep_group = body;
    b.unposed = true;
    b.pushed = b.watched = b.was_given = false;
    if (held) push(b, implementation_->settings.dt, *held);
    implementation_->placed.push_back(body);
}

void SharedWorld::kick(int body, const Eigen::Vector3d& linear, const Eigen::Vector3d& angular) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    if (!b.moves()) return;
    if (b.asleep) wake(body);
    implementation_->all_whole = false;
    b.state.velocity += linear / b.kind->mass.mass, b.state.angular_momentum += angular;
}

// What would go on into a plane stops there: a guess of what its owner finds.
void World::Implementation::stop_at_planes(MovingBody& body, const Eigen::Vector3d& before) const {
    WorldBodyState& s = body.state;
    for (const WorldPlane& plane : planes) {
        const Eigen::Vector3d own = s.orientation.conjugate() * plane.normal;
        const double reach = own.cwiseProduct(body.kind->half_box).norm();
        const double height = plane.normal.dot(s.position) - plane.offset;
        const double least = std::min(reach, plane.normal.dot(before) - plane.offset);
        if (height >= least) continue;
        s.position += (least - height) * plane.normal;
        s.velocity -= std::min(0.0, s.velocity.dot(plane.normal)) * plane.normal;
    }
}

void SharedWorld::extrapolate(int body, WorldBodyState& state, const StepImpulse* held) {
    MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    std::swap(b.state, state);
    const bool pushed = std::exchange(b.pushed, false);
    if (held) push(b, implementation_->settings.dt, *held);
    const Eigen::Vector3d before = b.state.position;
    move_freely(b, implementation_->settings);
    implementation_->stop_at_planes(b, before);
    const bool limited = b.limited_now;
    (void)limit_deformation(b);
    b.limited_now = limited;  // a guess of what its owner finds
    b.pushed = pushed;
    std::swap(b.state, state);
}

void SharedWorld::watch(int body, bool watched) {
    implementation_->bodies.at(static_cast<std::size_t>(body)).watched = watched;
}

const std::vector<CrossImpulse>& SharedWorld::cross_impulses() const noexcept {
    return implementation_->solver().cross().pairs();
}

const StepImpulse* SharedWorld::impulse(int body) const {
    const MovingBody& b = implementation_->bodies.at(static_cast<std::size_t>(body));
    return b.was_given ? &b.given : nullptr;
}

}  // namespace sim
