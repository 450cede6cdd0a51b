#include "bullet_peer.h"

#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletSoftBody/BulletReducedDeformableBody/btReducedDeformableBody.h>
#include <BulletSoftBody/BulletReducedDeformableBody/btReducedDeformableBodySolver.h>
#include <BulletSoftBody/btDeformableMultiBodyConstraintSolver.h>
#include <BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h>
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <btBulletDynamicsCommon.h>

#include <vector>

#include "falling_bodies.h"
#include "sim/surface_mesh.h"

namespace sim_bench {
namespace {

btVector3 to_bullet(const Eigen::Vector3d& v) {
    return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
}

btTransform at(const Eigen::Vector3d& position) {
    btTransform transform;
    transform.setIdentity();
    transform.setOrigin(to_bullet(position));
    return transform;
}

// What one ball is made of: the centre, then the surface's vertices; a tetrahedron for each triangle.
struct BallMesh {
    std::vector<Eigen::Vector3d> nodes;
    std::vector<std::array<std::uint32_t, 3>> triangles;  // of node indices
    std::vector<double> masses;
};

BallMesh ball_mesh(const sim::WorldBody& body) {
    const sim::SurfaceMesh surface = sim::surface_mesh(body.shape, body.triangles);
    BallMesh mesh;
    mesh.nodes.push_back(Eigen::Vector3d::Zero());
    mesh.nodes.insert(mesh.nodes.end(), surface.vertices.begin(),
                      surface.vertices.end() - static_cast<std::ptrdiff_t>(surface.features));
    mesh.masses.assign(mesh.nodes.size(), 0);
    double total = 0;
    for (const auto& t : surface.triangles) {
        mesh.triangles.push_back({t[0] + 1, t[1] + 1, t[2] + 1});
        const Eigen::Vector3d &a = surface.vertices[t[0]], &b = surface.vertices[t[1]],
                              &c = surface.vertices[t[2]];
        const double volume = std::abs(a.dot(b.cross(c))) / 6;
        for (const std::uint32_t node : {0u, t[0] + 1, t[1] + 1, t[2] + 1}) mesh.masses[node] += volume / 4;
        total += volume;
    }
    const double mass = sim::rigid_mass(body.shape.base, body.material).mass;
    for (double& m : mesh.masses) m *= mass / total;
    return mesh;
}

}  // namespace

struct BulletWorld::Implementation {
    // In order of construction; Bullet keeps plain pointers from each to those before it.
    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    std::unique_ptr<btReducedDeformableBodySolver> reduced_solver;
    std::unique_ptr<btDeformableMultiBodyConstraintSolver> reduced_constraints;
    btSequentialImpulseConstraintSolver rigid_constraints;
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btRigidBody>> rigid;
    std::vector<std::unique_ptr<btReducedDeformableBody>> reduced;
    std::unique_ptr<btDiscreteDynamicsWorld> world;
    btScalar dt;
    BulletKind kind;

    ~Implementation() {
        for (const auto& body : reduced)
            static_cast<btDeformableMultiBodyDynamicsWorld&>(*world).removeSoftBody(body.get());
        for (const auto& body : rigid) world->removeRigidBody(body.get());
    }

    void make_world(const sim::WorldSettings& settings);
    void add_box(const sim::WorldDefinition& definition);
    void add_rigid(const sim::WorldDefinition& definition, const BallMesh& mesh);
    void add_reduced(const sim::WorldDefinition& definition, const BallMesh& mesh);
    std::unique_ptr<btReducedDeformableBody> reduced_ball(const BallMesh& mesh);
    btRigidBody& add_body(btScalar mass, btCollisionShape& shape, const Eigen::Vector3d& position,
                          const sim::WorldBody& like);
};

void BulletWorld::Implementation::make_world(const sim::WorldSettings& settings) {
    dt = static_cast<btScalar>(settings.dt);
    if (kind != BulletKind::reduced) {
        world = std::make_unique<btDiscreteDynamicsWorld>(&dispatcher, &broadphase, &rigid_constraints,
                                                          &configuration);
    } else {
        reduced_solver = std::make_unique<btReducedDeformableBodySolver>();
        reduced_constraints = std::make_unique<btDeformableMultiBodyConstraintSolver>();
        reduced_constraints->setDeformableSolver(reduced_solver.get());
        auto deformable = std::make_unique<btDeformableMultiBodyDynamicsWorld>(
            &dispatcher, &broadphase, reduced_constraints.get(), &configuration, reduced_solver.get());
        deformable->setImplicit(false);
        deformable->setLineSearch(false);
        deformable->setUseProjection(false);
        btContactSolverInfo& info = deformable->getSolverInfo();
        info.m_deformable_erp = btScalar(0.2);
        info.m_deformable_cfm = btScalar(0.2);
        info.m_friction = btScalar(0.5);
        info.m_deformable_maxErrorReduction = btScalar(200);
        info.m_leastSquaresResidualThreshold = btScalar(1e-6);
        info.m_splitImpulse = false;
        world = std::move(deformable);
    }
    world->setGravity(to_bullet(settings.gravity));
}

btRigidBody& BulletWorld::Implementation::add_body(btScalar mass, btCollisionShape& shape,
                                                   const Eigen::Vector3d& position,
                                                   const sim::WorldBody& like) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) inertia = to_bullet(sim::rigid_mass(like.shape.base, like.material).inertia);
    btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, &shape, inertia);
    info.m_startWorldTransform = at(position);
    info.m_friction = static_cast<btScalar>(like.friction);
    info.m_restitution = static_cast<btScalar>(like.restitution);
    rigid.push_back(std::make_unique<btRigidBody>(info));
    rigid.back()->setActivationState(mass > 0 ? DISABLE_DEACTIVATION : ISLAND_SLEEPING);
    world->addRigidBody(rigid.back().get());
    return *rigid.back();
}

// A slab behind each plane; the planes are those of the coordinate axes.
void BulletWorld::Implementation::add_box(const sim::WorldDefinition& definition) {
    const double half = 2 * box_side(static_cast<int>(definition.bodies.size())) + 10, thickness = 2;
    for (const sim::WorldPlane& plane : definition.planes) {
        const Eigen::Vector3d n = plane.normal.cwiseAbs();
        const Eigen::Vector3d extents = thickness * n + half * (Eigen::Vector3d::Ones() - n);
        shapes.push_back(std::make_unique<btBoxShape>(to_bullet(extents)));
        add_body(0, *shapes.back(), (plane.offset - thickness) * plane.normal, definition.bodies.front());
    }
}

void BulletWorld::Implementation::add_rigid(const sim::WorldDefinition& definition, const BallMesh& mesh) {
    const sim::WorldBody& like = definition.bodies.front();
    std::unique_ptr<btConvexShape> shape;
    if (kind == BulletKind::spheres) {
        shape = std::make_unique<btSphereShape>(static_cast<btScalar>(like.shape.base.semi_axes.x()));
    } else {
        auto hull = std::make_unique<btConvexHullShape>();
        for (std::size_t i = 1; i < mesh.nodes.size(); ++i) hull->addPoint(to_bullet(mesh.nodes[i]), false);
        hull->recalcLocalAabb();
        shape = std::move(hull);
    }
    const double mass = sim::rigid_mass(like.shape.base, like.material).mass;
    for (const sim::WorldBody& body : definition.bodies)
        add_body(static_cast<btScalar>(mass), *shape, body.world_from_body.translation(), body);
    shapes.push_back(std::move(shape));
}

std::unique_ptr<btReducedDeformableBody> BulletWorld::Implementation::reduced_ball(const BallMesh& mesh) {
    std::vector<btVector3> nodes;
    for (const Eigen::Vector3d& node : mesh.nodes) nodes.push_back(to_bullet(node));
    auto& deformable = static_cast<btDeformableMultiBodyDynamicsWorld&>(*world);
    auto ball = std::make_unique<btReducedDeformableBody>(
        &deformable.getWorldInfo(), static_cast<int>(nodes.size()), nodes.data(), nullptr);
    for (const auto& t : mesh.triangles) {
        const std::array<int, 4> corner = {0, static_cast<int>(t[0]), static_cast<int>(t[1]),
                                           static_cast<int>(t[2])};
        ball->appendTetra(corner[0], corner[1], corner[2], corner[3]);
        for (int i = 0; i < 4; ++i)
            for (int j = i + 1; j < 4; ++j) ball->appendLink(corner[i], corner[j], nullptr, true);
    }
    btSoftBodyHelpers::generateBoundaryFaces(ball.get());
    ball->initializeDmInverse();
    ball->m_tetraScratches.resize(ball->m_tetras.size());
    ball->m_tetraScratchesTn.resize(ball->m_tetras.size());
    return ball;
}

void BulletWorld::Implementation::add_reduced(const sim::WorldDefinition& definition, const BallMesh& mesh) {
    const sim::WorldBody& like = definition.bodies.front();
    const sim::ModalBasis basis =
        sim::free_vibration_modes({like.shape.base, like.fidelity.domain, like.material,
                                   like.fidelity.elements, like.fidelity.modes})
            .basis;
    const int modes = basis.count(), nodes = static_cast<int>(mesh.nodes.size());
    std::vector<Eigen::Matrix3Xd> shape_at;
    for (const Eigen::Vector3d& node : mesh.nodes) shape_at.push_back(sim::mode_shapes_at(basis, node));
    btReducedDeformableBody::tDenseArray masses;
    for (const double m : mesh.masses) masses.push_back(static_cast<btScalar>(m));
    for (const sim::WorldBody& body : definition.bodies) {
        reduced.push_back(reduced_ball(mesh));
        btReducedDeformableBody& ball = *reduced.back();
        ball.setReducedModes(modes, nodes);
        ball.m_modes.resize(modes);
        for (int mode = 0; mode < modes; ++mode) {
            const btScalar stiffness = static_cast<btScalar>(basis.omega[mode] * basis.omega[mode]);
            ball.m_eigenvalues.push_back(stiffness);
            ball.m_Kr.push_back(stiffness);
            for (const Eigen::Matrix3Xd& at_node : shape_at)
                for (int k = 0; k < 3; ++k)
                    ball.m_modes[mode].push_back(static_cast<btScalar>(at_node(k, mode)));
        }
        ball.setMassProps(masses);
        ball.setInertiaProps();
        ball.internalInitialization();
        ball.disableReducedModes(false);
        static_cast<btDeformableMultiBodyDynamicsWorld&>(*world).addSoftBody(&ball);
        ball.getCollisionShape()->setMargin(btScalar(0.01));
        ball.transformTo(at(body.world_from_body.translation()));
        // Stiffness-proportional, the given share of critical at the lowest mode.
        ball.setDamping(0, static_cast<btScalar>(2 * body.damping_ratio / basis.omega[0]));
        ball.m_cfg.kKHR = 1;
        ball.m_cfg.kCHR = 1;
        ball.m_cfg.kDF = 0;
        ball.m_cfg.collisions = btSoftBody::fCollision::SDF_RD | btSoftBody::fCollision::SDF_RDN;
        ball.m_sleepingThreshold = 0;
        ball.setActivationState(DISABLE_DEACTIVATION);
    }
}

BulletWorld::BulletWorld(const sim::WorldDefinition& world, BulletKind kind)
    : implementation_(std::make_unique<Implementation>()) {
    implementation_->kind = kind;
    implementation_->make_world(world.settings);
    implementation_->add_box(world);
    const BallMesh mesh = ball_mesh(world.bodies.front());
    if (kind != BulletKind::reduced) implementation_->add_rigid(world, mesh);
    if (kind == BulletKind::reduced) implementation_->add_reduced(world, mesh);
}

BulletWorld::~BulletWorld() = default;
BulletWorld::BulletWorld(BulletWorld&&) noexcept = default;
BulletWorld& BulletWorld::operator=(BulletWorld&&) noexcept = default;

void BulletWorld::step() {
    implementation_->world->stepSimulation(implementation_->dt, 1, implementation_->dt);
}

Eigen::Vector3d BulletWorld::position(int body) const {
    constexpr int kSlabs = 5;
    const btVector3 p =
        implementation_->kind != BulletKind::reduced
            ? implementation_->rigid[static_cast<std::size_t>(kSlabs + body)]->getCenterOfMassPosition()
            : implementation_->reduced[static_cast<std::size_t>(body)]->getRigidTransform().getOrigin();
    return {p.x(), p.y(), p.z()};
}

bool bullet_is_there() noexcept {
    return true;
}

std::string bullet_version() {
    return std::to_string(btGetVersion() / 100) + "." + std::to_string(btGetVersion() % 100);
}

}  // namespace sim_bench
