#include "body/free_rotation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace {

using Eigen::Quaterniond, Eigen::Vector3d;

const Vector3d kInertia(1, 2, 3), kSpin(0.01, 10, 0.01);

double energy(const Quaterniond& q, const Vector3d& momentum, const Vector3d& inertia) {
    const Vector3d m = q.conjugate() * momentum;
    return 0.5 * m.cwiseProduct(m).cwiseQuotient(inertia).sum();
}

// Euler's equations and the kinematics of the quaternion by fourth-order Runge-Kutta.
struct Motion {
    Eigen::Vector4d q;  // x, y, z, w
    Vector3d omega;     // body axes
};

Motion rate(const Motion& at, const Vector3d& inertia) {
    const Quaterniond spin(0, at.omega.x(), at.omega.y(), at.omega.z());
    const Vector3d torque_free = inertia.cwiseProduct(at.omega).cross(at.omega).cwiseQuotient(inertia);
    return {0.5 * (Quaterniond(at.q) * spin).coeffs(), torque_free};
}

Motion plus(const Motion& a, double k, const Motion& b) {
    return {a.q + k * b.q, a.omega + k * b.omega};
}

Motion runge_kutta(Motion at, const Vector3d& inertia, double time, int steps) {
    const double h = time / steps;
    for (int i = 0; i < steps; ++i) {
        const Motion a = rate(at, inertia), b = rate(plus(at, h / 2, a), inertia),
                     c = rate(plus(at, h / 2, b), inertia), d = rate(plus(at, h, c), inertia);
        at = plus(plus(plus(plus(at, h / 6, a), h / 3, b), h / 3, c), h / 6, d);
    }
    return at;
}

double angle_between(const Quaterniond& a, const Quaterniond& b) {
    return 2 * (a.conjugate() * b).vec().norm();
}

// Error of the orientation after 1 s of a tumble in `steps` steps [rad].
double error_after_a_second(const Vector3d& inertia, const Vector3d& omega, int steps) {
    const Vector3d momentum = inertia.cwiseProduct(omega);
    Quaterniond q = Quaterniond::Identity();
    for (int i = 0; i < steps; ++i) q = sim::rotate_freely(q, momentum, inertia, 1.0 / steps);
    const Motion exact = runge_kutta({Quaterniond::Identity().coeffs(), omega}, inertia, 1, 40000);
    return angle_between(q, Quaterniond(exact.q).normalized());
}

struct Spin {
    int flips = 0;
    double energy_error_early = 0, energy_error_late = 0, momentum_error = 0, length_error = 0;
};

// `seconds` at 1/60 s; the momentum compared is R I omega of the body's own angular velocity after each step.
Spin spin(double seconds) {
    const Vector3d momentum = kInertia.cwiseProduct(kSpin);
    const sim::FreeRotation rotation(kInertia, 1.0 / 60);
    const double start_energy = energy(Quaterniond::Identity(), momentum, kInertia);
    Quaterniond q = Quaterniond::Identity();
    Spin seen;
    const int steps = static_cast<int>(60 * seconds);
    for (int i = 0; i < steps; ++i) {
        const double side = (q.conjugate() * momentum).y();
        q = rotation.advance(q, momentum);
        const Vector3d omega = (q.conjugate() * momentum).cwiseQuotient(kInertia);
        seen.flips += side * omega.y() < 0;
        const Vector3d now = q.toRotationMatrix() * kInertia.cwiseProduct(omega);
        double& worst = i < steps / 10 ? seen.energy_error_early : seen.energy_error_late;
        worst = std::max(worst, std::abs(energy(q, momentum, kInertia) / start_energy - 1));
        seen.momentum_error = std::max(seen.momentum_error, (now - momentum).norm() / momentum.norm());
        seen.length_error = std::max(seen.length_error, std::abs(q.norm() - 1));
    }
    return seen;
}

TEST(FreeRotation, ABodyWithMoments1To2To3SpunAboutItsMiddleAxisFlips22TimesIn60Seconds) {
    EXPECT_EQ(spin(60).flips, 22);
    // The same from Euler's equations, in steps forty times finer.
    Motion at{Quaterniond::Identity().coeffs(), kSpin};
    int flips = 0;
    for (int i = 0; i < 3600; ++i) {
        const double before = at.omega.y();
        at = runge_kutta(at, kInertia, 1.0 / 60, 40);
        flips += before * at.omega.y() < 0;
    }
    EXPECT_EQ(flips, 22);
}

TEST(FreeRotation, Over600SecondsMomentumHoldsTo1EMinus12AndEnergyTo5EMinus4WithoutDrift) {
    const Spin seen = spin(600);
    EXPECT_LT(seen.momentum_error, 1e-12);  // rounding: the orientation stays a rotation
    EXPECT_LT(seen.length_error, 1e-15);    // renormalised each step
    EXPECT_LT(seen.energy_error_early, 5e-4);
    EXPECT_LT(seen.energy_error_late, 5e-4);
    // No drift: nine tenths of the run see no more than the first tenth, but for where the steps fall.
    EXPECT_LT(seen.energy_error_late, 1.05 * seen.energy_error_early);
}

TEST(FreeRotation, StepsOfUpToAHundredRadiansKeepTheEnergy) {
    for (const double turn : {0.3, 3.0, 30.0, 100.0}) {
        const Vector3d momentum = kInertia.cwiseProduct(turn * Vector3d(0.6, 0.7, 0.4));
        const double before = energy(Quaterniond::Identity(), momentum, kInertia);
        Quaterniond q = Quaterniond::Identity();
        for (int i = 0; i < 100; ++i) {
            q = sim::rotate_freely(q, momentum, kInertia, 1);
            ASSERT_NEAR(energy(q, momentum, kInertia) / before, 1, 3e-4) << turn << " rad, step " << i;
        }
    }
}

TEST(FreeRotation, HalvingTheStepQuartersTheErrorOfATumble) {
    for (const Vector3d& inertia : {Vector3d(1, 2, 3), Vector3d(3, 1, 2.5), Vector3d(2, 3, 1)}) {
        const Vector3d omega(1, 3, -2);
        const double coarse = error_after_a_second(inertia, omega, 60),
                     fine = error_after_a_second(inertia, omega, 120),
                     finest = error_after_a_second(inertia, omega, 240);
        EXPECT_LT(coarse, 1e-2);
        EXPECT_NEAR(coarse / fine, 4, 0.1) << inertia.transpose();  // 4 + O(dt^2)
        EXPECT_NEAR(fine / finest, 4, 0.1) << inertia.transpose();
    }
}

TEST(FreeRotation, SymmetricTopsAndSpheresAreExactInStepsOfAnyLength) {
    for (const Vector3d& inertia :
         {Vector3d(1, 1, 2), Vector3d(3, 1, 1), Vector3d(2, 0.5, 2), Vector3d(2, 2, 2)})
        // Two roundings a step against the reference's own error, (10 / 40000)^4 or so.
        EXPECT_LT(error_after_a_second(inertia, Vector3d(4, -7, 5), 3), 1e-10) << inertia.transpose();
}

TEST(FreeRotation, ASphereTurnsByAngularVelocityTimesTime) {
    const Vector3d omega(0.3, -0.4, 1.2);  // 1.3 rad/s
    const Quaterniond q = sim::rotate_freely(Quaterniond::Identity(), 5 * omega, Vector3d(5, 5, 5), 2);
    const Quaterniond expected(Eigen::AngleAxisd(2.6, omega.normalized()));
    EXPECT_LT(angle_between(q, expected), 1e-15);
}

TEST(FreeRotation, TheStepBackUndoesTheStepForth) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> any(-1, 1);
    for (int i = 0; i < 1000; ++i) {
        const Vector3d inertia = Vector3d(any(random), any(random), any(random)).array() + 1.5;
        const Vector3d momentum = 20 * Vector3d(any(random), any(random), any(random));
        const Quaterniond q =
            Quaterniond(Eigen::Vector4d(any(random), any(random), any(random), 1)).normalized();
        const Quaterniond forth = sim::rotate_freely(q, momentum, inertia, 0.05),
                          back = sim::rotate_freely(forth, momentum, inertia, -0.05);
        EXPECT_LT(angle_between(q, back), 1e-14);
    }
}

TEST(FreeRotation, RestAndExtremeMomentumStayUnitAndFinite) {
    const Quaterniond q(0.5, -0.5, 0.5, 0.5);
    EXPECT_EQ(angle_between(sim::rotate_freely(q, Vector3d::Zero(), kInertia, 1), q), 0);
    for (const double size : {1e-300, 1e-9, 1e3, 1e12, 1e100})
        EXPECT_NEAR(sim::rotate_freely(q, size * Vector3d(1, -2, 3), kInertia, 1.0 / 60).norm(), 1, 1e-15)
            << size;
}

}  // namespace
