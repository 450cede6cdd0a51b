#include "sim/simulation.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <random>

#include "struck/body_model.h"
#include "test_kit.h"

namespace {

using Eigen::Vector3d;

const sim::Impulse kStrike{0, 0.0, Vector3d(0.09, 0.1, 0.02), Vector3d(0, -0.3, 0)};

TEST(Simulation, ReferenceStrikeDisplacesTheStruckPointByItsShareOfTheSize) {
    for (const sim::Superquadric& shape : {sim::Superquadric{{0.18, 0.1, 0.18}, 0.1, 1},
                                           {{0.2, 0.006, 0.2}, 1, 1},
                                           {{0.3, 0.0025, 0.0025}, 0.1, 1}}) {
        sim::BodyDefinition body = sim_test::drum();
        body.shape = shape;
        const sim::BodyModel model(body);
        double most = 0;
        for (int k = 0; k < 3; ++k) {
            Vector3d r = Vector3d::Zero();
            if (k != 1) r[k] = 0.95 * shape.semi_axes[k];
            r = model.gauge().along_axis(r, 1);
            const sim::OscillatorState kicked = model.kick({0, 0, r, Vector3d(0, -1.5 * 0.05 * 5, 0)});
            for (double t = 0; t < 0.2; t += 1e-5) {
                const sim::Vector6d q = model.to_modal(model.after(kicked, t)).q;
                most = std::max(most, std::abs(q[5] * r.x() + q[1] * r.y() + q[3] * r.z()));
            }
        }
        EXPECT_NEAR(most / (0.03 * 2 * shape.semi_axes.maxCoeff()), 1, 1e-3);  // sampled peaks
    }
}

TEST(Simulation, LowestModeHasTheVisibleFrequencyAndAllAreSixtyDecibelsDownAfterTheDecayTime) {
    const sim::BodyModel model(sim_test::drum());
    EXPECT_NEAR(model.omega().head<6>().minCoeff() / (2 * M_PI), 6, 1e-12);
    EXPECT_NEAR(std::exp(-model.sigma()[0] * 0.6), 1e-3, 1e-15);
    EXPECT_LT(
        (model.omega().head<6>() / model.omega()[0] - model.linear().omega / model.linear().omega[0]).norm(),
        1e-12);
}

TEST(Simulation, PictureStateIsTheFoldedStatesMotionPlusWeightedResponses) {
    const auto once = sim::make_local_simulation({sim_test::drum()}),
               apart = sim::make_local_simulation({sim_test::drum()});
    sim::Impulse second = kStrike;
    second.t_s = 0.013;
    second.point_body.x() = -0.05;
    sim::StepRequest folded{0.02, {kStrike, second}, {}, {}, {{0.05, {}}}};
    sim::StepRequest provisional{0.02, {kStrike}, {}, {}, {{0.05, {{second, 0.4}, {second, 0.6}}}}};
    const sim::ModalState a = once->step(folded).pictures[0][0], b = apart->step(provisional).pictures[0][0];
    EXPECT_LT((a.q - b.q).norm(), 1e-15);
    EXPECT_LT((a.q_dot - b.q_dot).norm(), 1e-12);
    EXPECT_GT(a.q.norm(), 1e-3);
}

TEST(Simulation, ImpulsesOfTheFutureDoNotShowInAPicture) {
    const auto simulation = sim::make_local_simulation({sim_test::drum()});
    sim::Impulse later = kStrike;
    later.t_s = 0.06;
    EXPECT_EQ(simulation->step({0.02, {}, {}, {}, {{0.05, {{later, 1}}}}}).pictures[0][0].q,
              sim::Vector6d::Zero());
}

TEST(Simulation, ManySmallStepsEqualOneLongStepToRounding) {
    const auto small = sim::make_local_simulation({sim_test::bell(Vector3d::Zero())}),
               large = sim::make_local_simulation({sim_test::bell(Vector3d::Zero())});
    (void)small->step({0, {kStrike}, {}, {}, {}});
    (void)large->step({0, {kStrike}, {}, {}, {}});
    sim::ModalState s;
    for (int i = 1; i <= 100; ++i) s = small->step({0.003 * i, {}, {}, {}, {}}).states[0];
    const sim::ModalState l = large->step({0.003 * 100, {}, {}, {}, {}}).states[0];
    EXPECT_LT((s.q - l.q).norm(), 1e-13);
    EXPECT_NEAR(s.swing, l.swing, 1e-14);
    EXPECT_GT(std::abs(l.swing), 1e-5);
}

TEST(Simulation, AHundredViolentStrikesLeaveTheDeformationInvertibleAndFinite) {
    std::mt19937 rng(5);
    std::uniform_real_distribution<double> unit(-1, 1);
    for (const sim::BodyDefinition& body :
         {sim_test::drum(), sim_test::bell(Vector3d::Zero()), sim_test::string_body(Vector3d::Zero())}) {
        const auto simulation = sim::make_local_simulation({body});
        for (int i = 0; i < 100; ++i) {
            const Vector3d r = Vector3d(unit(rng), unit(rng), unit(rng)).cwiseProduct(body.shape.semi_axes);
            const double t = 0.002 * i;
            const sim::StepRequest request{
                t,
                {{0, t, r, Vector3d(unit(rng), unit(rng), unit(rng)) * 100}},
                {},
                {sim_test::path_through(Vector3d::Zero(), Vector3d(0, -5, 0), Vector3d::Zero(), t)},
                {}};
            const sim::StepReply reply = simulation->step(request);
            const Eigen::Matrix4d m =
                body.world_from_body.inverse().matrix() * sim::body_matrix(body, reply.states[0]);
            ASSERT_TRUE(m.allFinite());
            const Eigen::Matrix3d square = m.topLeftCorner<3, 3>().transpose() * m.topLeftCorner<3, 3>();
            ASSERT_GE(Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(square).eigenvalues()[0],
                      0.3 * 0.3 - 1e-9);
            for (const sim::Contact& c : reply.contacts)
                ASSERT_TRUE(std::isfinite(c.speed_mps) && c.point_world.allFinite());
        }
    }
}

TEST(Simulation, BodyMatrixAtRestIsTheBodysPlaceAndTheHingeKeepsItsPivot) {
    const sim::BodyDefinition bell = sim_test::bell(Vector3d(1, 2, 3));
    EXPECT_LT((sim::body_matrix(bell, {}) - bell.world_from_body.matrix()).norm(), 1e-15);
    sim::ModalState swung;
    swung.swing = 0.3;
    const Eigen::Vector4d pivot = bell.stand.pivot_body.homogeneous();
    EXPECT_LT((sim::body_matrix(bell, swung) * pivot - bell.world_from_body.matrix() * pivot).norm(), 1e-15);
}

TEST(Simulation, ConfirmedImpulsesAreFeltByContactsFromTheirTimeOn) {
    const auto simulation = sim::make_local_simulation({sim_test::drum()});
    sim::StepRequest request{
        0,
        {},
        {},
        {sim_test::path_through(Vector3d(0, 0.1, 0), Vector3d(0, -5, 0), Vector3d::Zero(), 0)},
        {}};
    const sim::Contact at_rest = simulation->step(request).contacts.at(0);
    request.confirmed = {{0, 0.06, Vector3d(0, 0.1, 0), Vector3d(0, -0.5, 0)}};
    EXPECT_NEAR(simulation->step(request).contacts.at(0).t_s, at_rest.t_s,
                1e-7);  // a contact's stated precision
    request.confirmed[0].t_s = 0.005;
    const sim::Contact moving = simulation->step(request).contacts.at(0);
    EXPECT_GT(moving.t_s, at_rest.t_s + 1e-4);  // the head has gone down
    EXPECT_NE(moving.speed_mps, at_rest.speed_mps);
    EXPECT_EQ(simulation->step({0.1, {}, {}, {}, {}}).states[0].q, sim::Vector6d::Zero());  // never folded
}

TEST(Simulation, BeginningAnewIsAFreshSimulationToTheBitAtAnyTime) {
    const auto used = sim::make_local_simulation({sim_test::drum()}),
               fresh = sim::make_local_simulation({sim_test::drum()});
    (void)used->step({5, {kStrike}, {}, {}, {}});
    EXPECT_NE(used->step({5.01, {}, {}, {}, {}}).states[0].q, sim::Vector6d::Zero());
    sim::StepRequest first{0, {}, {}, {}, {}};
    first.anew = true;
    EXPECT_EQ(used->step(first).states[0].q, sim::Vector6d::Zero());
    (void)fresh->step(first);
    const sim::StepRequest struck{0.02, {kStrike}, {}, {}, {}};
    EXPECT_EQ(used->step(struck).states[0].q, fresh->step(struck).states[0].q);
}

TEST(Simulation, RestDistanceAndZoneAreThoseOfAContact) {
    const sim::BodyDefinition drum = sim_test::drum(Vector3d(0.1, 0.7, 0));
    const sim::SurfacePoint p = sim::rest_distance(drum, Vector3d(0.12, 0.83, 0), 0.006);
    EXPECT_NEAR(p.distance, 0.024, 1e-6);
    EXPECT_LT((p.normal - Vector3d::UnitY()).norm(), 1e-3);
    EXPECT_EQ(sim::rest_zone(drum, Vector3d(0.12, 0.83, 0)), 0);
    EXPECT_EQ(sim::rest_zone(drum, Vector3d(0.1, 0.5, 0)), -1);
}

TEST(Simulation, BadDefinitionsAndRequestsAreRejectedWithTheValueFound) {
    sim::BodyDefinition bad = sim_test::drum();
    bad.material.poisson = 0.5;
    EXPECT_THROW((void)sim::make_local_simulation({bad}), std::invalid_argument);
    const auto simulation = sim::make_local_simulation({sim_test::drum()});
    (void)simulation->step({1, {}, {}, {}, {}});
    EXPECT_THROW((void)simulation->step({0.5, {}, {}, {}, {}}), std::invalid_argument);
    EXPECT_THROW((void)simulation->step({2, {{7, 1, Vector3d::Zero(), Vector3d::Zero()}}, {}, {}, {}}),
                 std::invalid_argument);
    EXPECT_THROW((void)simulation->step({2, {}, {}, {{0, 0.006, {}}}, {}}), std::invalid_argument);
    EXPECT_THROW((void)simulation->step({std::nan(""), {}, {}, {}, {}}), std::invalid_argument);
}

}  // namespace
