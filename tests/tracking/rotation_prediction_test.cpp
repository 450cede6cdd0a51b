// Orientations: turns about any axis, sign flips, tumbling, and the other forms that sensors report.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <sstream>

#include "trace/random_stream.h"
#include "tracking/predictor.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kLead = 1.0 / 15;

PoseSample turned(double t, const Quaterniond& q) {
    PoseSample sample;
    sample.t_s = t;
    sample.orientation = q;
    sample.has_orientation = true;
    return sample;
}

double turn_between(const Quaterniond& a, const Quaterniond& b) {
    return logarithm(a * b.conjugate()).norm();
}

Quaterniond negated(const Quaterniond& q) {
    return {-q.w(), -q.x(), -q.y(), -q.z()};
}

/// A turn at a constant rate about a random axis from a random orientation.
struct Turn {
    Vector3d w;  // rad/s
    Quaterniond start;
    double rate_hz;

    Turn(double fastest_hz, RandomStream& random)
        : w(std::exp(std::log(0.5) + random.uniform() * std::log(120.0)) *
            random.normal_vector(1).normalized()),
          start(exponential(random.normal_vector(2))),
          rate_hz(60 + (fastest_hz - 60) * random.uniform()) {}

    [[nodiscard]] Quaterniond at(double t) const { return exponential(w * t) * start; }
};

class Turning : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Predictors, Turning,
                         testing::Values("cv", "ca", "singer", "thesis", "bank", "imm", "difference",
                                         "least-squares", "double-exponential", "ca:gate=5"));

// 0.5 to 60 rad/s at 60 to 250 Hz: at most 1 rad a sample, through many half turns. The samples' own times
// and quaternions are rounded: 60 rad/s times 1e-15 s, 1e-16, times the gains.
TEST_P(Turning, ConstantRatesAboutAnyAxisArePredictedTo1e9thOfARadian) {
    RandomStream random(3);
    double worst = 0, worst_rate = 0;
    for (int trial = 0; trial < 60; ++trial) {
        const Turn turn(250, random);
        const auto predictor = make_predictor(GetParam());
        const auto samples = static_cast<int>(8 * turn.rate_hz);
        for (int i = 0; i <= samples; ++i) {
            const Quaterniond q = turn.at(i / turn.rate_hz);
            (void)predictor->correct(turned(i / turn.rate_hz, random.uniform() < 0.3 ? negated(q) : q));
        }
        const PosePrediction ahead = predictor->predict(kLead);
        worst = std::max(worst, turn_between(ahead.orientation, turn.at(samples / turn.rate_hz + kLead)));
        worst_rate = std::max(worst_rate, (ahead.angular_velocity - turn.w).norm());
    }
    std::printf("%-20s constant rates: %.2g rad, %.2g rad/s\n", GetParam(), worst, worst_rate);
    EXPECT_LT(worst, 1e-9);
    EXPECT_LT(worst_rate, 1e-7);
}

// Errors of a rate act along a turn; a filter that took them as if they did not was unstable from 0.55 rad a
// sample on. Rounding must not grow over a minute. (Nearer to pi the start overshoots half a turn and starts
// anew.)
TEST(Rotation, BetweenTwoDirectionsTurnsOneIntoTheOtherAlsoOppositeOnes) {
    std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> pairs = {{{0, 0, -1}, {0, 0, 1}},
                                                                      {{0, 0, -1}, {0, 0, -1}},
                                                                      {{3, 0, 0}, {-2, 1e-9, 0}},
                                                                      {{1, 2, 3}, {-3, 1, 0.5}}};
    for (const auto& [from, to] : pairs) {
        const Eigen::Quaterniond q = rotation_between(from, to);
        EXPECT_NEAR(q.norm(), 1, 1e-14);
        // Near opposite directions the half turn is taken for them: off by what lies between, 1e-9 here.
        EXPECT_LT((q * from.normalized() - to.normalized()).norm(), 2e-9);
    }
    // Elsewhere the same numbers as Eigen's.
    const Eigen::Vector3d from(0, 0, -1), to(0.3, -0.8, 0.1);
    EXPECT_EQ(rotation_between(from, to).coeffs(), Eigen::Quaterniond::FromTwoVectors(from, to).coeffs());
}

TEST(Orientation, FiltersAreStableOnTurnsOfUpTo2Point3RadiansASample) {
    for (const char* name : {"cv", "ca", "singer", "thesis", "imm", "ca:q=1e11"})
        for (const double a_sample : {0.3, 0.6, 1.0, 1.7, 2.3}) {
            const Vector3d w = 60 * a_sample * Vector3d(1, -2, 2) / 3;
            const auto predictor = make_predictor(name);
            for (int i = 0; i <= 3600; ++i)
                (void)predictor->correct(turned(i / 60.0, exponential(w * (i / 60.0))));
            const PosePrediction ahead = predictor->predict(kLead);
            EXPECT_LT(turn_between(ahead.orientation, exponential(w * (60 + kLead))), 1e-9)
                << name << ' ' << a_sample;
        }
}

TEST(Orientation, SignsOfQuaternionsChangeNotOneBit) {
    for (const std::string& name : predictor_names()) {
        RandomStream random(5);
        const auto plain = make_predictor(name), flipped = make_predictor(name);
        Quaterniond q = Quaterniond::Identity();
        for (int i = 0; i < 300; ++i) {
            q = (exponential(random.normal_vector(0.2)) * q).normalized();
            (void)plain->correct(turned(i / 120.0, q));
            (void)flipped->correct(turned(i / 120.0, random.uniform() < 0.5 ? negated(q) : q));
            const PosePrediction a = plain->predict(kLead), b = flipped->predict(kLead);
            EXPECT_TRUE(a.orientation.coeffs() == b.orientation.coeffs() ||
                        a.orientation.coeffs() == -b.orientation.coeffs())
                << name << " at sample " << i;
            EXPECT_EQ(a.angular_velocity, b.angular_velocity) << name;
        }
    }
}

/// A free body with moments of inertia 1, 2, 3 that starts about its middle axis, which is unstable: it
/// tumbles. Euler's equations and q' = q (0, w_body) / 2 by Runge and Kutta's method, steps of 1/19200 s: at
/// 10 rad/s the error stays below 1e-11 rad a second.
class TumblingBody {
public:
    static constexpr int kStepsPerSecond = 19200;

    void step() {
        const double h = 1.0 / kStepsPerSecond;
        const State a = slope(now_), b = slope(now_ + h / 2 * a), c = slope(now_ + h / 2 * b),
                    d = slope(now_ + h * c);
        now_ += h / 6 * (a + 2 * b + 2 * c + d);
        now_.tail<4>().normalize();
    }
    [[nodiscard]] Quaterniond orientation() const { return {now_(3), now_(4), now_(5), now_(6)}; }

private:
    using State = Eigen::Matrix<double, 7, 1>;  // w_body, then q as w, x, y, z
    static State slope(const State& s) {
        State out;
        out.head<3>() =
            Vector3d((2 - 3) * s(1) * s(2) / 1, (3 - 1) * s(2) * s(0) / 2, (1 - 2) * s(0) * s(1) / 3);
        const Quaterniond rate = Quaterniond(s(3), s(4), s(5), s(6)) * Quaterniond(0, s(0), s(1), s(2));
        out.tail<4>() << 0.5 * rate.w(), 0.5 * rate.x(), 0.5 * rate.y(), 0.5 * rate.z();
        return out;
    }
    State now_ = (State() << 0.1, 10, 0.2, 1, 0, 0, 0).finished();
};

/// Largest error of predictions `lead` ahead over 20 s of tumbling, from 1 s on.
double worst_tumbling(const std::string& name, int rate, double lead) {
    static const std::vector<Quaterniond> path = [] {
        std::vector<Quaterniond> all;
        TumblingBody body;
        for (int i = 0; i <= 21 * TumblingBody::kStepsPerSecond; ++i, body.step())
            if (i % 20 == 0) all.push_back(body.orientation());
        return all;  // 960 a second
    }();
    const int every = 960 / rate;
    const auto ahead = static_cast<std::size_t>(std::lround(lead * 960));
    const auto predictor = make_predictor(name);
    double worst = 0;
    for (int k = 0; k < 20 * rate; ++k) {
        const auto i = static_cast<std::size_t>(k * every);
        (void)predictor->correct(turned(static_cast<double>(i) / 960, path[i]));
        if (k >= rate)
            worst = std::max(worst, turn_between(predictor->predict(lead).orientation, path[i + ahead]));
    }
    return worst;
}

// One sample ahead, without noise: constant rates leave dt^2 dw/dt, constant angular accelerations dt^3. A
// filter that trusts its sensor (r of a nanometre) tends to the same.
TEST(Orientation, TumblingIsPredictedWithErrorsOfTheExpectedOrder) {
    const struct {
        const char* name;
        double order;
    } cases[] = {{"hold", 1},      {"difference", 2}, {"double-exponential", 2}, {"least-squares", 3},
                 {"cv:r=1e-6", 2}, {"ca:r=1e-6", 3},  {"singer:r=1e-6", 3}};
    for (const auto& c : cases) {
        const double at120 = worst_tumbling(c.name, 120, 1.0 / 120),
                     at480 = worst_tumbling(c.name, 480, 1.0 / 480);
        const double order = std::log(at120 / at480) / std::log(4.0);
        std::printf("%-20s tumbling: %.2g rad at 120 Hz, %.2g at 480 Hz, order %.2f\n", c.name, at120, at480,
                    order);
        EXPECT_NEAR(order, c.order, 0.3) << c.name;
    }
}

// No predictor may do worse than holding the orientation does (but for 2 %, as times differ).
TEST(Orientation, TumblingNeverMakesAPredictorRunAway) {
    for (const int rate : {60, 120, 240}) {
        const double held = worst_tumbling("hold", rate, kLead);
        for (const std::string& name : predictor_names()) {
            const double worst = worst_tumbling(name, rate, kLead);
            if (rate == 60)
                std::printf("%-20s tumbling, 60 Hz, 1/15 s ahead: %.2g rad\n", name.c_str(), worst);
            EXPECT_LE(worst, 1.02 * held) << name << ' ' << rate;
        }
    }
}

// --- other forms

/// A hand that swings through a middle Euler angle of 90 degrees both ways while it twists.
Quaterniond swinging(double t) {
    return exponential({0.6 * std::sin(3 * t), 0, 0}) * exponential({0, 1.4 + 0.9 * std::sin(5 * t), 0}) *
           exponential({0, 0, 1.2 * std::sin(2 * t)});
}

std::string number(double x) {
    std::ostringstream out;
    out.precision(17);
    out << x;
    return out.str();
}

std::string row(double t, const std::string& orientation) {
    return number(t) + ",a," + number(std::sin(t)) + ",1,0," + orientation + "\n";
}

std::string listed(const Vector3d& v) {
    return number(v.x()) + "," + number(v.y()) + "," + number(v.z());
}

/// Intrinsic X-Y-Z in degrees, the middle one within +-90 as trackers report it.
Vector3d euler_degrees(const Quaterniond& q) {
    const Eigen::Matrix3d r = q.toRotationMatrix();
    return 180 / M_PI *
           Vector3d(std::atan2(-r(1, 2), r(2, 2)), std::atan2(r(0, 2), std::hypot(r(0, 0), r(0, 1))),
                    std::atan2(-r(0, 1), r(0, 0)));
}

struct Texts {
    std::string quaternions = "t,stick,px,py,pz,qw,qx,qy,qz\n", increments = "t,stick,px,py,pz,rx,ry,rz\n",
                euler = "t,stick,px,py,pz,ex,ey,ez\n";
};

Texts texts_of_swinging() {
    Texts texts;
    Quaterniond before = Quaterniond::Identity();
    for (int i = 0; i < 600; ++i) {
        const double t = i / 120.0;
        const Quaterniond q = swinging(t);
        texts.quaternions += row(t, number(q.w()) + "," + listed(q.vec()));
        texts.increments += row(t, listed(logarithm(before.conjugate() * q)));
        texts.euler += row(t, listed(euler_degrees(q)));
        before = q;
    }
    return texts;
}

// Increments add 600 roundings, Euler angles lose what their sines do near 90 degrees; angular accelerations
// multiply both by (lead / dt)^2 = 64 and the gains.
TEST(Orientation, IncrementalRotationsAndEulerAnglesThroughGimbalLockPredictAsQuaternionsDo) {
    const Texts texts = texts_of_swinging();
    const Trace quaternions = parse_trace(texts.quaternions, "q");
    for (const auto& [form, text] : {std::pair{"increments", texts.increments}, {"Euler", texts.euler}}) {
        const Trace other = parse_trace(text, form);
        double worst = 0;
        for (const std::string& name : predictor_names()) {
            const auto a = make_predictor(name), b = make_predictor(name);
            for (std::size_t i = 0; i < 600; ++i) {
                (void)a->correct(quaternions.sticks[0].samples[i]);
                (void)b->correct(other.sticks[0].samples[i]);
                worst = std::max(worst,
                                 turn_between(a->predict(kLead).orientation, b->predict(kLead).orientation));
            }
        }
        std::printf("%s: predictions differ by at most %.2g rad\n", form, worst);
        EXPECT_LT(worst, 1e-9) << form;
    }
}

TEST(Orientation, ThatAppearsLateIsTakenUpThereWithAnUncertaintyOfAnyAngleBefore) {
    for (const char* name : {"cv", "ca", "singer", "thesis", "bank", "imm"}) {
        const auto late = make_predictor(name), fresh = make_predictor(name);
        for (int i = 0; i < 100; ++i) {
            PoseSample sample = turned(i / 120.0, swinging(i / 120.0));
            sample.has_orientation = i >= 40;
            (void)late->correct(sample);
            if (i == 39) {
                EXPECT_EQ(late->predict(kLead).angular_velocity, Vector3d::Zero());
                EXPECT_NEAR(late->covariance(kLead)->rotation(0, 0), M_PI * M_PI / 3, 1e-12);
            }
            if (i >= 40) (void)fresh->correct(sample);
        }
        if (std::string(name) == "bank") continue;  // may have selected another model by now
        EXPECT_EQ(late->predict(kLead).orientation.coeffs(), fresh->predict(kLead).orientation.coeffs())
            << name;
    }
}

TEST(Orientation, ThatDropsOutIsTurnedOnMeanwhileAndLessCertain) {
    for (const char* name : {"cv", "ca", "singer", "thesis", "bank", "imm"}) {
        RandomStream random(7);
        for (int trial = 0; trial < 20; ++trial) {
            const Turn turn(250, random);
            const auto predictor = make_predictor(name);
            double before = 0;
            const auto last = static_cast<int>(8 * turn.rate_hz);
            for (int i = 0; i <= last; ++i) {
                PoseSample sample = turned(i / turn.rate_hz, turn.at(i / turn.rate_hz));
                sample.has_orientation = i < last - 10;
                (void)predictor->correct(sample);
                if (i == last - 11) before = predictor->covariance(kLead)->rotation(0, 0);
            }
            // Ten samples are up to 1/6 s more than a lead.
            EXPECT_LT(
                turn_between(predictor->predict(kLead).orientation, turn.at(last / turn.rate_hz + kLead)),
                1e-8)
                << name;
            EXPECT_GT(predictor->covariance(kLead)->rotation(0, 0), before) << name;
            const double back = (last + 1) / turn.rate_hz;
            (void)predictor->correct(turned(back, turn.at(back)));
            EXPECT_LT(turn_between(predictor->predict(kLead).orientation, turn.at(back + kLead)), 1e-8)
                << name;
        }
    }
}

}  // namespace
}  // namespace tracking
