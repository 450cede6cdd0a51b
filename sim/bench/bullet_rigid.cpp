#include <btBulletDynamicsCommon.h>

#include <algorithm>

#include "rigid_peer.h"

namespace sim_bench {
namespace {

/// Half extents of the slab that stands for a plane, in those of the scene: single precision knows a small
/// body on it the better the smaller it is.
constexpr double kSlab = 20, kSlabThickness = 2;

constexpr const char* kManyIterations = "50 iterations, full warm start";  // what stacks need

btVector3 to_bullet(const Eigen::Vector3d& v) {
    return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}
btTransform to_bullet(const Eigen::Isometry3d& at) {
    const Eigen::Quaterniond q(at.linear());
    return btTransform(btQuaternion(static_cast<btScalar>(q.x()), static_cast<btScalar>(q.y()),
                                    static_cast<btScalar>(q.z()), static_cast<btScalar>(q.w())),
                       to_bullet(at.translation()));
}
Eigen::Vector3d from_bullet(const btVector3& v) {
    return {v.x(), v.y(), v.z()};
}

/// In order of construction; Bullet keeps plain pointers from each to those before it.
class BulletRigid : public RigidPeer {
public:
    BulletRigid(const sim::WorldDefinition& definition, const PeerSettings& settings)
        : settings_(settings), moving_(definition.bodies.size()) {
        world_.setGravity(to_bullet(definition.settings.gravity));
        if (settings.method == kManyIterations) {
            world_.getSolverInfo().m_numIterations = 50;
            world_.getSolverInfo().m_warmstartingFactor = 1;
        }
        for (const sim::WorldBody& body : definition.bodies) {
            add(body);
            extent_ = std::max(
                extent_, body.world_from_body.translation().norm() + body.shape.base.semi_axes.maxCoeff());
        }
        for (const sim::WorldPlane& plane : definition.planes) add(plane);
        for (const sim::PointConstraint& constraint : definition.constraints) add(constraint);
    }
    ~BulletRigid() override {
        for (const auto& joint : joints_) world_.removeConstraint(joint.get());
        for (const auto& body : bodies_) world_.removeRigidBody(body.get());
    }
    BulletRigid(const BulletRigid&) = delete;
    BulletRigid& operator=(const BulletRigid&) = delete;

    void step() override { world_.stepSimulation(static_cast<btScalar>(settings_.dt), 0); }

    [[nodiscard]] std::vector<RigidState> states() override {
        std::vector<RigidState> all;
        for (std::size_t i = 0; i < moving_; ++i) {
            const btTransform& at = bodies_[i]->getWorldTransform();
            const btQuaternion q = at.getRotation();
            all.push_back({from_bullet(at.getOrigin()), Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z()),
                           from_bullet(bodies_[i]->getLinearVelocity()),
                           from_bullet(bodies_[i]->getAngularVelocity())});
        }
        return all;
    }

private:
    std::unique_ptr<btCollisionShape> shape_of(const sim::WorldBody& body) const {
        const Eigen::Vector3d& half = body.shape.base.semi_axes;
        const PeerShape kind = peer_shape(body, settings_.hulls);
        if (kind == PeerShape::sphere)
            return std::make_unique<btSphereShape>(static_cast<btScalar>(half.x()));
        // Its own margin of 4 cm is thicker than a card.
        const btScalar margin = static_cast<btScalar>(std::min(0.04, 0.05 * half.minCoeff()));
        if (kind == PeerShape::box) {
            auto box = std::make_unique<btBoxShape>(to_bullet(half));
            box->setMargin(margin);
            return box;
        }
        auto hull = std::make_unique<btConvexHullShape>();
        for (const Eigen::Vector3d& point : hull_points(body)) hull->addPoint(to_bullet(point), false);
        hull->recalcLocalAabb();
        hull->setMargin(margin / 10);  // stands around the hull
        return hull;
    }

    void add(const sim::WorldBody& body) {
        shapes_.push_back(shape_of(body));
        const sim::RigidMass rigid = sim::rigid_mass(body.shape.base, body.material);
        const btScalar mass = body.fixed ? 0 : static_cast<btScalar>(rigid.mass);
        btRigidBody::btRigidBodyConstructionInfo info(
            mass, nullptr, shapes_.back().get(), body.fixed ? btVector3(0, 0, 0) : to_bullet(rigid.inertia));
        info.m_startWorldTransform = to_bullet(body.world_from_body);
        info.m_friction = static_cast<btScalar>(body.friction);
        info.m_restitution = static_cast<btScalar>(body.restitution);
        bodies_.push_back(std::make_unique<btRigidBody>(info));
        btRigidBody& made = *bodies_.back();
        if (!settings_.sleeping) made.setActivationState(DISABLE_DEACTIVATION);
        if (!body.fixed) {
            made.setLinearVelocity(to_bullet(body.velocity));
            made.setAngularVelocity(to_bullet(body.angular_velocity));
            // Continuous detection of its own: a sphere within the body is swept where a step is longer.
            const btScalar least = static_cast<btScalar>(body.shape.base.semi_axes.minCoeff());
            made.setCcdMotionThreshold(least / 2);
            made.setCcdSweptSphereRadius(least * btScalar(0.8));
        }
        world_.addRigidBody(&made);
        if (body.gravity_scale != 1) made.setGravity(made.getGravity() * btScalar(body.gravity_scale));
    }

    void add(const sim::WorldPlane& plane) {
        const double thickness = kSlabThickness * extent_;
        shapes_.push_back(
            std::make_unique<btBoxShape>(to_bullet(extent_ * Eigen::Vector3d(kSlab, kSlabThickness, kSlab))));
        Eigen::Isometry3d at = Eigen::Isometry3d::Identity();
        at.linear() =
            Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitY(), plane.normal).toRotationMatrix();
        at.translation() = (plane.offset - thickness) * plane.normal;
        btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shapes_.back().get());
        info.m_startWorldTransform = to_bullet(at);
        info.m_friction = static_cast<btScalar>(plane.friction);
        info.m_restitution = static_cast<btScalar>(plane.restitution);
        bodies_.push_back(std::make_unique<btRigidBody>(info));
        world_.addRigidBody(bodies_.back().get());
    }

    void add(const sim::PointConstraint& c) {
        btRigidBody& a = *bodies_[static_cast<std::size_t>(c.body_a)];
        joints_.push_back(c.body_b < 0 ? std::make_unique<btPoint2PointConstraint>(a, to_bullet(c.point_a))
                                       : std::make_unique<btPoint2PointConstraint>(
                                             a, *bodies_[static_cast<std::size_t>(c.body_b)],
                                             to_bullet(c.point_a), to_bullet(c.point_b)));
        world_.addConstraint(joints_.back().get(), true);
    }

    PeerSettings settings_;
    double extent_ = 0;   ///< of the bodies about the origin [m]
    std::size_t moving_;  ///< bodies of the definition; planes come after them
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadphase_;
    btSequentialImpulseConstraintSolver solver_;
    btDiscreteDynamicsWorld world_{&dispatcher_, &broadphase_, &solver_, &configuration_};
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
    std::vector<std::unique_ptr<btPoint2PointConstraint>> joints_;
};

}  // namespace

bool add_bullet(std::vector<PeerLibrary>& peers) {
    peers.push_back(
        {"Bullet",
         std::to_string(btGetVersion() / 100) + "." + std::to_string(btGetVersion() % 100),
         true,
         {"10 iterations", kManyIterations},
         "sequential impulses, continuous detection on, margins of a twentieth of the least half extent; "
         "joints are btPoint2PointConstraint; single precision",
         [](const sim::WorldDefinition& world, const PeerSettings& settings) -> std::unique_ptr<RigidPeer> {
             return std::make_unique<BulletRigid>(world, settings);
         }});
    return true;
}

}  // namespace sim_bench
