// Newton's method over an island's rows, and substeps that are solved by it.
#include "solver/direct_solution.h"

#include <gtest/gtest.h>

#include "solver_island.h"

namespace {

using namespace world_test;

/// A chain of balls that hangs from a place in the world.
sim::WorldDefinition chain(int count, double stiffness) {
    sim::WorldDefinition world;
    for (int i = 0; i < count; ++i) {
        world.bodies.push_back(ball({0.3 * (i + 1), 0, 0}, sim::Fidelity::rigid, 0.1, 1000));
        sim::PointConstraint c;
        c.body_a = i, c.point_a = {-0.15, 0, 0};
        c.body_b = i - 1, c.point_b = {0.15, 0, 0};
        c.stiffness = stiffness, c.collide = false;
        world.constraints.push_back(c);
    }
    return world;
}

/// The parts that a direct solution needs.
struct Direct {
    explicit Direct(SolverIsland& test)
        : rows(test.begin()),
          forces(rows),
          impacts(rows, forces),
          found(rows),
          solution(rows, forces, impacts, found) {
        forces.begin_step(test.no_forces);
        found.note_places();
        impacts.begin();
        solution.begin_step();
    }
    sim::IslandRows& rows;
    sim::AppliedForces forces;
    sim::Impacts impacts;
    sim::FoundContacts found;
    sim::DirectSolution solution;
};

TEST(DirectSolution, TheEndsOfStiffSpringsStayTogetherInAChainThatFalls) {
    SolverIsland test(chain(6, 1e9));
    Direct direct(test);
    ASSERT_TRUE(direct.solution.begin(1e9));
    for (int i = 0; i < 4; ++i) {
        direct.rows.substep.number = i, direct.rows.substep.passed = 0;
        direct.solution.substep(0, i == 3, false);
    }
    for (sim::SpringRows& s : direct.rows.springs) {
        direct.rows.write_spring(s);
        // 1e9 N/m carry the chain's 250 N within 0.25 um; ends are brought together to 1e-8 of a ball.
        EXPECT_LT(s.gap.norm(), 1e-6);
    }
    EXPECT_LT(test.bodies[5].state.velocity.y(), -0.01);  // it falls
}

TEST(DirectSolution, SoftSpringsAreForcesAndStiffOnesAreNot) {
    SolverIsland soft(chain(2, 1)), stiff(chain(2, 1e6));
    EXPECT_TRUE(Direct(soft).solution.springs_are_soft());
    EXPECT_FALSE(Direct(stiff).solution.springs_are_soft());
}

TEST(NewtonSolver, FindsTheMinimumThatADenseSolutionFinds) {
    SolverIsland test(chain(4, 1e4));
    sim::IslandRows& rows = test.begin();
    sim::NewtonSolver newton(rows);
    ASSERT_TRUE(newton.begin(1e9, false, false));
    for (sim::SpringRows& s : rows.springs) {
        rows.write_spring(s);
        newton.widen(s, 1);
        s.offset.setConstant(0.01), s.gamma = 1e-3;
    }
    Draw draw(3);
    for (double& x : newton.start) x = draw.between(-1, 1);
    newton.y = newton.start;
    newton.minimise();
    // (1 + sum D^T D / gamma) y = start - sum D^T offset / gamma, with rows as seen column by column.
    const auto size = static_cast<Eigen::Index>(newton.start.size());
    Eigen::MatrixXd h = Eigen::MatrixXd::Identity(size, size);
    Eigen::VectorXd right = Eigen::Map<const Eigen::VectorXd>(newton.start.data(), size);
    for (const sim::SpringRows& s : rows.springs) {
        Eigen::MatrixXd d(3, size);
        for (Eigen::Index k = 0; k < size; ++k) {
            sim::AlignedDoubles unit(newton.start.size(), 0.);
            unit[std::size_t(k)] = 1;
            d.col(k) = newton.seen(s, unit);
        }
        h += d.transpose() * d / s.gamma;
        right -= d.transpose() * s.offset / s.gamma;
    }
    const Eigen::VectorXd expected = h.llt().solve(right),
                          got = Eigen::Map<const Eigen::VectorXd>(newton.y.data(), size);
    EXPECT_LT((got - expected).norm(), 1e-10 * expected.norm());  // condition about 1e3
}

}  // namespace
