#include "sim/accuracy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "elastic_solid.h"
#include "modes/contact_compliance.h"
#include "shape/superquadric.h"
#include "world_bodies.h"

namespace sim {
namespace {

using Eigen::Vector3d;

double hertz_approach(double radius, const Material& m, double speed) {  // Johnson 1985, 11.21
    const double modulus = m.young_pa / (1 - m.poisson * m.poisson);
    const double mass = m.density_kg_m3 * 4 * M_PI / 3 * std::pow(radius, 3);
    return std::pow(15 * mass * speed * speed / (16 * modulus * std::sqrt(radius)), 0.4);
}

WorldBody falling(const Vector3d& half, double exponent, const Material& material, double speed) {
    WorldBody body;
    body.name = "body";
    body.shape.base = {half, exponent, exponent};
    body.material = material;
    body.damping_ratio = 0;
    body.world_from_body.translation() = Vector3d(0, half.y() + 0.005 * half.y(), 0);
    body.velocity = Vector3d(0, -speed, 0);
    return body;
}

WorldScene scene_of(const WorldBody& body, double dt) {
    WorldScene scene;
    scene.world = world_test::on_floor();
    scene.world.settings.dt = dt;
    scene.world.settings.sleeping = false;
    scene.world.bodies = {body};
    return scene;
}

double worst_of(const AccuracyReport& report) {
    double worst = 0;
    for (const BodyError& body : report.bodies) worst = std::max(worst, body.total());
    return worst;
}

// The constant of ContactCompliance was found at 2.5 % of the diameter; the limits are what Hertz's own
// assumption of a small patch leaves at either end.
TEST(ContactCompliance, ABallYieldsToAnImpactAsHertzSays) {
    for (const double radius : {0.01, 5.0})
        for (const double share : {0.003, 0.02, 0.06}) {
            const Material unit{1e6, 0.3, 1000};
            const double speed = std::pow(share * 2 * radius / hertz_approach(radius, unit, 1), 1.25);
            const ContactCompliance ball({Vector3d::Constant(radius), 1, 1}, unit);
            EXPECT_NEAR(ball.displacement(1, {.speed = speed}), share * 2 * radius, 0.1 * share * 2 * radius)
                << "radius " << radius << ", " << share << " of the diameter";
            // Hertz: 2.94 times the approach over the speed.
            EXPECT_NEAR(ball.contact_time(1, {.speed = speed}), 2.94 * share * 2 * radius / speed,
                        0.2 * 2.94 * share * 2 * radius / speed);
        }
}

TEST(ContactCompliance, AFlatFaceYieldsAsABarDoes) {
    // A cube that hits with a whole face, its mass taken back by uniform stress: c = L / (3 A E).
    const double side = 0.8, young = 1e6;
    const ContactCompliance cube({Vector3d::Constant(side / 2), 0.1, 0.1}, {young, 0.3, 1000});
    const double bar = 1 / (3 * side * young);
    for (const int place : {0, 1, 2}) {
        const double patch = std::sqrt(side * side / M_PI);
        // The face's middle yields more than its mean.
        EXPECT_GE(cube.of_patch(place, patch), bar) << place;
        EXPECT_LE(cube.of_patch(place, patch), 1.6 * bar) << place;
    }
}

TEST(ContactCompliance, MoreModesYieldMoreAndRigidBodiesNotAtAll) {
    const ContactCompliance body({{0.4, 0.2, 0.3}, 0.7, 1}, {1e6, 0.3, 500});
    for (int place = 0; place < kContactPlaces; ++place) {
        EXPECT_EQ(body.of_modes(place, Fidelity::rigid, 0, 1), 0);
        double before = 0;
        for (const int modes : {11, 23, 45, 75, 120}) {
            const double now = body.of_modes(place, Fidelity::modal, modes, 3);
            EXPECT_GE(now, before);
            before = now;
        }
        const ComplianceErrors few = body.errors(place, {.speed = 1}, Fidelity::rigid, 0, 1);
        EXPECT_NEAR(few.truncation, M_PI * body.displacement(place, {.speed = 1}), 1e-9 * few.truncation);
    }
}

Eigen::Matrix3d cross_matrix(const Vector3d& v) {
    Eigen::Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

/// A body without outside forces that turns: its static displacement, by 150 modes, under the load of its inertia,
/// -rho A r with A r = w x (w x r) + w' x r (body axes) and w' by Euler's equations.
class TurningBody {
public:
    TurningBody(const Superquadric& shape, const Material& material)
        : shape_(shape),
          rigid_(rigid_mass(shape, material)),
          basis_(free_vibration_modes({shape, ModeDomain::superquadric, material, 2, 150}).basis),
          moments_(9, basis_.count()) {
        const Gauge gauge(shape);
        constexpr int kCells = 20;
        const Vector3d cell = 2 * shape.semi_axes / kCells;
        moments_.setZero();
        double inside = 0;
        for (int i = 0; i < kCells * kCells * kCells; ++i) {
            const Vector3d corner(i % kCells, i / kCells % kCells, i / kCells / kCells);
            const Vector3d r = cell.cwiseProduct(corner + Vector3d::Constant(0.5)) - shape.semi_axes;
            if (gauge.value(r) > 1) continue;
            const Eigen::Matrix3Xd phi = mode_shapes_at(basis_, r);
            for (int k = 0; k < 3; ++k) moments_.middleRows<3>(3 * k) += r[k] * phi;
            ++inside;
        }
        moments_ *= rigid_.mass / inside;
    }

    /// Of the pole that moves most [m].
    [[nodiscard]] double displacement(const Vector3d& spin) const {
        const Vector3d turn = -spin.cross(rigid_.inertia.cwiseProduct(spin)).cwiseQuotient(rigid_.inertia);
        const Eigen::Matrix3d w = cross_matrix(spin), a = w * w + cross_matrix(turn);
        const Eigen::VectorXd load = -moments_.transpose() * a.reshaped();
        const Eigen::VectorXd q = load.cwiseQuotient(basis_.omega.cwiseAbs2());
        double most = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const Vector3d pole = shape_.semi_axes[axis] * Vector3d::Unit(axis);
            most = std::max(most, (mode_shapes_at(basis_, pole) * q).norm());
        }
        return most;
    }

private:
    Superquadric shape_;
    RigidMass rigid_;
    ModalBasis basis_;
    Eigen::MatrixXd moments_;  // integrals of rho r_k phi, 3 rows for each k
};

double stretch_bound(const Superquadric& shape, const Material& material, const Vector3d& spin) {
    WorldBody body;
    body.shape.base = shape, body.material = material;
    body.fidelity.fidelity = Fidelity::linear;
    body.angular_velocity = spin;
    WorldDefinition definition = world_test::weightless();
    definition.bodies = {body};
    return centrifugal_stretch(World(definition), 0);
}

TEST(CentrifugalStretch, IsWhatABarThatTurnsEndOverEndGrowsByAndNoShapeGrowsMore) {
    const Material matter{1e6, 0.3, 1000};
    const Superquadric bar{{0.5, 0.04, 0.04}, 0.1, 0.1};
    const double closed_form = 1000 * 100 * 0.25 / 3e6;  // rho w^2 a^2 / (3 E)
    EXPECT_NEAR(stretch_bound(bar, matter, {0, 10, 0}), closed_form, 1e-12);
    // Its edges are rounded: 1 % of its matter is missing.
    EXPECT_NEAR(TurningBody(bar, matter).displacement({0, 10, 0}) / 0.5, closed_form, 0.02 * closed_form);
    world_test::Draw draw(7);
    for (const auto& [half, exponent] : {std::pair(Vector3d(0.5, 0.04, 0.04), 0.1),
                                         {{0.5, 0.5, 0.5}, 1},
                                         {{0.5, 0.1, 0.5}, 1},
                                         {{0.5, 0.1, 0.1}, 1},
                                         {{0.5, 0.04, 0.5}, 0.1},
                                         {{0.5, 0.04, 0.3}, 0.1},
                                         {{0.5, 0.5, 0.5}, 0.1},
                                         {{0.5, 0.3, 0.2}, 0.6}}) {
        const Superquadric shape{half, exponent, exponent};
        const TurningBody body(shape, matter);
        for (int i = 0; i < 40; ++i) {
            const Vector3d spin = 10 * (i < 3 ? Vector3d(Vector3d::Unit(i)) : draw.direction());
            // 2 %: the middle of a square plate's edge, whose matter is drawn in less than a bar's.
            EXPECT_LE(body.displacement(spin) / 0.5, 1.03 * stretch_bound(shape, matter, spin))
                << half.transpose() << " at " << spin.transpose();
        }
    }
}

// The oracle itself, against Hertz: it is as coarse as its cells, a sixth of the diameter.
TEST(ElasticSolid, ABallBouncesAsHertzSays) {
    const Material m{2e6, 0.3, 300};
    ElasticSolid ball({6, 6, 6},
                      [](const Vector3d& t) -> Vector3d {
                          const double size = t.cwiseAbs().maxCoeff();
                          return size > 0 ? Vector3d(0.5 * size * t.normalized()) : Vector3d::Zero();
                      },
                      {m.young_pa, m.poisson, m.density_kg_m3});
    Eigen::Isometry3d start = Eigen::Isometry3d::Identity();
    start.translation().y() = 0.5;
    ball.start(start, {0, -1, 0}, Vector3d::Zero());
    const double approach = hertz_approach(0.5, m, 1), energy = ball.energy();
    ball.run(1.47 * approach);  // half of the contact
    EXPECT_NEAR(0.5 - ball.centre().y(), approach, 0.1 * approach);
    ball.run(3 * approach);
    EXPECT_GT(ball.centre().y(), 0.5);
    EXPECT_NEAR(ball.energy(), energy, 0.05 * energy) << "nodes that touch give up what they carry";
}

struct Encounter {
    const char* name;
    WorldBody body;
    std::array<int, 3> cells;
    double seconds;
};

// Root mean square over the surface, share of the largest extent, at the worst of ten moments.
double distance_to_solid(const WorldScene& scene, const Encounter& e) {
    const Superquadric& shape = e.body.shape.base;
    const Gauge gauge(shape);
    ElasticSolid solid(e.cells,
                       [&](const Vector3d& t) -> Vector3d {
                           const Vector3d at = t.cwiseProduct(shape.semi_axes);
                           const double size = t.cwiseAbs().maxCoeff();
                           if (shape.e1 < 0.3 || size == 0) return at;
                           return size * gauge.onto_surface(at / size);
                       },
                       {e.body.material.young_pa, e.body.material.poisson, e.body.material.density_kg_m3});
    solid.gravity = scene.world.settings.gravity;
    solid.start(e.body.world_from_body, e.body.velocity, e.body.angular_velocity);
    World world(scene.world);
    double worst = 0;
    for (int moment = 1; moment <= 10; ++moment) {
        while (world.time_s() < moment * e.seconds / 10 - 1e-9) world.step();
        solid.run(e.seconds / 10);
        const WorldBodyState state = world.state(0);
        double sum = 0;
        for (const int node : solid.surface()) {
            Vector3d r = solid.rest(node);
            if (state.q.size() > 0) r += mode_shapes_at(world.basis(0), r) * state.q;
            sum += (state.position + state.orientation * r - solid.place[std::size_t(node)]).squaredNorm();
        }
        worst = std::max(worst, std::sqrt(sum / double(solid.surface().size())));
    }
    return worst / (2 * shape.semi_axes.maxCoeff());
}

// Until the end of the contact; rebounds then part what they part.
TEST(Accuracy, BodiesThatHitAPlaneStayWithinTheEstimateOfANonlinearSolid) {
    std::vector<Encounter> encounters = {
        {"ball", falling(Vector3d::Constant(0.3), 1, {5e5, 0.3, 500}, 2), {6, 6, 6}, 0.15},
        {"flat ellipsoid", falling({0.5, 0.2, 0.4}, 1, {1e6, 0.3, 800}, 3), {6, 6, 6}, 0.12},
        {"box", falling(Vector3d::Constant(0.3), 0.2, {3e5, 0.3, 500}, 1), {5, 5, 5}, 0.1},
        {"rubber ball", falling(Vector3d::Constant(0.025), 1, {2e6, 0.3, 1100}, 1), {6, 6, 6}, 0.012},
        {"bar", falling({0.1, 0.5, 0.1}, 0.1, {1e6, 0.3, 1000}, 2), {3, 12, 3}, 0.08}};
    encounters[1].body.world_from_body.translation().y() = 0.42;
    encounters[1].body.world_from_body.linear() =
        Eigen::AngleAxisd(0.5, Vector3d(1, 0, 0.5).normalized()).toRotationMatrix();
    constexpr double kOfSolid = 0.015;  // its own, by other cells
    for (const Encounter& e : encounters)
        for (const double asked : {0.1, 0.03}) {
            WorldScene scene = scene_of(e.body, std::min(1.0 / 60, e.seconds / 10));
            const AccuracyReport report = keep_accuracy(
                scene, {asked, std::uint64_t(std::llround(e.seconds / scene.world.settings.dt))});
            const double error = distance_to_solid(scene, e);
            EXPECT_LE(error, worst_of(report) + kOfSolid) << e.name << ", asked " << asked;
            // An estimate that says nothing would pass, too.
            EXPECT_LE(worst_of(report), 0.2) << e.name << ", asked " << asked;
        }
}

TEST(Accuracy, AStiffBallOnASlopeStaysRigidAndRollsAsFarAsItShould) {
    for (const double angle : {0.05, 0.2}) {
        WorldBody ball = falling(Vector3d::Constant(0.1), 1, {1e9, 0.3, 2000}, 0);
        ball.world_from_body.translation().y() = 0.1;
        WorldScene scene = scene_of(ball, 1.0 / 60);
        scene.world.settings.gravity = 9.81 * Vector3d(std::sin(angle), -std::cos(angle), 0);
        const AccuracyReport report = keep_accuracy(scene, {0.02, 60});
        EXPECT_EQ(scene.world.bodies[0].fidelity.fidelity, Fidelity::rigid);
        EXPECT_LE(worst_of(report), 0.02);
        World world(scene.world);
        world_test::run(world, 60 * report.step_parts);
        // 5/7 of the acceleration: a rolling ball.
        EXPECT_NEAR(world.state(0).position.x(), 5.0 / 14 * 9.81 * std::sin(angle), 0.02 * 0.2);
    }
}

TEST(Accuracy, WhatIsAskedForChoosesAndTighterAskingNeverCostsLess) {
    int modes = 0;
    for (const double asked : {0.3, 0.1, 0.05, 0.02}) {
        WorldScene scene = scene_of(falling(Vector3d::Constant(0.5), 1, {2e5, 0.3, 300}, 1), 1.0 / 60);
        const AccuracyReport report = keep_accuracy(scene, {asked, 18});
        const FidelityRequest& f = scene.world.bodies[0].fidelity;
        const int now = f.fidelity == Fidelity::modal ? f.modes : f.fidelity == Fidelity::linear ? 6 : 0;
        EXPECT_NE(f.fidelity, Fidelity::automatic);
        EXPECT_GE(now, modes) << asked;
        modes = now;
        EXPECT_EQ(scene.world.settings.dt, 1.0 / 60 / report.step_parts);
    }
    EXPECT_GE(modes, 75);
}

TEST(Accuracy, ItChangesNeitherNamedNorFixedNorPrescribedBodiesNorAStepThatIsKept) {
    WorldScene scene = scene_of(falling(Vector3d::Constant(0.5), 1, {2e5, 0.3, 300}, 1), 1.0 / 60);
    scene.world.bodies[0].fidelity.fidelity = Fidelity::linear;
    scene.world.bodies.push_back(world_test::box({3, 1, 0}, {0.5, 0.5, 0.5}));
    scene.world.bodies.back().fidelity.fidelity = Fidelity::automatic;
    scene.world.bodies.push_back(scene.world.bodies.back());
    scene.world.bodies[1].fixed = true;
    // It pushes the ball from below: pressed on, but no force moves or bends it.
    scene.world.bodies[2].motion = {{0, {0, -1, 0}}, {0.2, {0, 0.2, 0}}};
    const AccuracyReport report =
        keep_accuracy(scene, {.accuracy = 0.01, .steps = 12, .until_rest = false, .keep_step = true});
    EXPECT_EQ(scene.world.bodies[0].fidelity.fidelity, Fidelity::linear);
    EXPECT_EQ(scene.world.bodies[0].triangles, 360);
    EXPECT_EQ(scene.world.bodies[1].fidelity.fidelity, Fidelity::automatic);
    EXPECT_EQ(scene.world.bodies[2].fidelity.fidelity, Fidelity::automatic);
    EXPECT_EQ(report.step_parts, 1);
    EXPECT_EQ(scene.world.settings.dt, 1.0 / 60);
    EXPECT_GT(report.bodies[0].truncation, 0.01) << "a linear body cannot show this contact";
    EXPECT_EQ(report.bodies[1].total(), 0);
    EXPECT_LT(report.bodies[2].total(), 1e-6) << "its path is given: paths are kept as floats";
}

TEST(Accuracy, EventsKeepTheirTimeWhereStepsAreDivided) {
    WorldScene scene = scene_of(falling(Vector3d::Constant(0.5), 1, {6e6, 0.3, 300}, 1), 1.0 / 60);
    scene.later = {falling(Vector3d::Constant(0.2), 1, {1e6, 0.3, 300}, 0)};
    scene.later[0].world_from_body.translation() = Vector3d(2, 1, 0);
    scene.events = {{6, {}, 0, 1, {}}};
    const AccuracyReport report = keep_accuracy(scene, {0.03, 18});
    EXPECT_GT(report.step_parts, 1);
    EXPECT_EQ(scene.events[0].step, 6u * unsigned(report.step_parts));
    EXPECT_NE(scene.later[0].fidelity.fidelity, Fidelity::automatic);
    EXPECT_EQ(report.bodies.size(), 2u);
}

TEST(Accuracy, AChaoticSceneSaysFromWhenItsPathsHangOnTheStep) {
    WorldScene scene;
    scene.world.settings.sleeping = false;
    for (const double x : {0.1, 0.3}) {
        WorldBody rod = world_test::box({x, 2, 0}, {0.1, 0.01, 0.01}, 800);
        rod.name = x < 0.2 ? "inner" : "outer";
        rod.fidelity.fidelity = Fidelity::automatic;
        scene.world.bodies.push_back(rod);
    }
    PointConstraint hinge;
    hinge.point_a = Vector3d(-0.1, 0, 0), hinge.point_b = Vector3d(0, 2, 0), hinge.stiffness = 1e7;
    scene.world.constraints.push_back(hinge);
    hinge.body_b = 1, hinge.point_a = Vector3d(0.1, 0, 0), hinge.point_b = Vector3d(-0.1, 0, 0);
    scene.world.constraints.push_back(hinge);
    const AccuracyReport report = keep_accuracy(scene, {0.01, 600});
    ASSERT_TRUE(report.parted_s);
    EXPECT_GT(*report.parted_s, 0.5) << "at first it swings like any other";
    EXPECT_LT(*report.parted_s, 9);
    EXPECT_GT(worst_of(report), 0.01);
}

TEST(Accuracy, TheSameSceneGivesTheSameChoice) {
    const WorldScene start = scene_of(falling({0.4, 0.3, 0.35}, 0.6, {3e5, 0.3, 400}, 2), 1.0 / 60);
    WorldScene once = start, again = start;
    const AccuracyReport a = keep_accuracy(once, {0.03, 12}), b = keep_accuracy(again, {0.03, 12});
    EXPECT_EQ(worst_of(a), worst_of(b));
    EXPECT_EQ(a.step_parts, b.step_parts);
    EXPECT_EQ(World(once.world).state_hash(), World(again.world).state_hash());
    EXPECT_EQ(once.world.bodies[0].triangles, again.world.bodies[0].triangles);
}

}  // namespace
}  // namespace sim
