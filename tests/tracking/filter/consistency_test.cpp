// Filters on data simulated from their own models: innovations and errors must be as large as the filter
// says (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).
#include <gtest/gtest.h>

#include <cstdio>

#include "filter/outlier_gate.h"
#include "simulated_motion.h"
#include "tracking/predictor.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kNoise = 0.25e-3;   // r=0.25
constexpr double kV0 = 1, kA0 = 10;  // v0=1000 and the default a0=1e4
constexpr std::array<double, 3> kLeads = {0, 1.0 / 30, 1.0 / 15};
constexpr double kPeriod = 1.0 / 60;

/// Tells the filter the spread of the start: the first sample's own noise for the position.
std::string with_start(const std::string& specification) {
    const bool bare = specification.find(':') == std::string::npos;
    return specification + (bare ? ":" : ",") + "r=0.25,p0=0.25,v0=1000";
}

struct Case {
    std::string specification;
    std::vector<LinearMotion> models;
    double rate = 0;

    /// In any of the models.
    [[nodiscard]] World start(RandomStream& random) const {
        World world{models, rate, 0, normal_columns(random)};
        if (models.size() > 1) world.mode = static_cast<std::size_t>(2.999 * random.uniform());
        world.x.row(1) *= kV0;
        world.x.row(2) *= models[world.mode].order == 2 ? 0 : kA0;
        return world;
    }
};

const Case kExact[] = {{"cv:q=1e8", {{2, 0, 1e2}}},
                       {"cv:q=1e8,decay=10", {{2, 10, 1e2}}},
                       {"ca:q=1e9", {{3, 0, 1e3}}},
                       {"singer:alpha=3,q=1e10", {{3, 3, 1e4}}},
                       {"singer:alpha=30,q=1e11", {{3, 30, 1e5}}},
                       {"thesis", {{3, 0, 0, Vector3d(1e-3, 20e-3, 63e-3)}}}};
const Case kImm = {"imm:alpha=3,q1=1e9,q2=3e10,q3=1e12,rate=10", {{3, 3, 1e3}, {3, 3, 3e4}, {3, 3, 1e6}}, 10};

double step_length(bool uneven, RandomStream& random) {
    return uneven ? 0.002 + 0.03 * random.uniform() : kPeriod;
}

double square(const Vector3d& error, const Matrix3d& covariance) {
    return error.dot(covariance.ldlt().solve(error));
}

/// The squares of many runs under the names of their quantities.
struct Squares {
    struct Quantity {
        const char* name;
        double lead;
        NormalisedSquares squares;
    };
    std::vector<Quantity> quantities;

    /// Every mean within `part` of 1.
    void expect_near(const std::string& of, double part) const {
        double least = 1, most = 1;
        for (const Quantity& q : quantities) {
            least = std::min(least, q.squares.mean());
            most = std::max(most, q.squares.mean());
        }
        std::printf("%-30s means %.3f to %.3f\n", of.c_str(), least, most);
        EXPECT_GE(least, 1 - part) << of;
        EXPECT_LE(most, 1 + part) << of;
    }

    /// Prints the mean furthest from 1, in its standard errors, and the least share of steps inside.
    void expect_honest(const std::string& of, double deviations, double least_share) const {
        double furthest = 0, least = 1, mean_there = 1;
        for (const Quantity& q : quantities) {
            const double off = (q.squares.mean() - 1) / q.squares.standard_error();
            if (std::abs(off) > std::abs(furthest)) furthest = off, mean_there = q.squares.mean();
            least = std::min(least, q.squares.share_inside());
            EXPECT_LE(std::abs(off), deviations) << of << ": " << q.name << " at lead " << q.lead << ": mean "
                                                 << q.squares.mean() << " +- " << q.squares.standard_error();
            EXPECT_GE(q.squares.share_inside(), least_share) << of << ": " << q.name << " at lead " << q.lead;
        }
        std::printf("%-50s furthest mean %.4f (%+.1f standard errors), least share of steps inside %.2f\n",
                    of.c_str(), mean_there, furthest, least);
    }
};

/// One run: squares of the errors after each sample, and of the innovation of the next.
class Run {
public:
    Run(const Case& of, bool uneven, RandomStream& random)
        : predictor_(make_predictor(with_start(of.specification))),
          uneven_(uneven),
          random_(random),
          world_(of.start(random)) {
        measure();
    }

    void step() {
        const double dt = step_length(uneven_, random_);
        for (std::size_t i = 0; i < kLeads.size(); ++i)
            compare(i, world_.after(kLeads[i], last_dt_, random_).x);
        world_.advance(last_dt_ = dt, random_);
        t_ += dt;
        const Vector3d expected = predictor_->predict(dt).position;
        const Matrix3d s = predictor_->covariance(dt)->position + kNoise * kNoise * Matrix3d::Identity();
        innovation_.push_back(square(measure() - expected, s));
    }
    void add_to(Squares& sum) const {
        if (sum.quantities.empty()) {
            const NormalisedSquares none(innovation_.size());
            sum.quantities.push_back({"innovation", 0, none});
            for (const double lead : kLeads) {
                sum.quantities.push_back({"position", lead, none});
                sum.quantities.push_back({"velocity", lead, none});
            }
        }
        sum.quantities[0].squares.add_run(innovation_);
        for (std::size_t i = 0; i < kLeads.size(); ++i) {
            sum.quantities[2 * i + 1].squares.add_run(position_[i]);
            sum.quantities[2 * i + 2].squares.add_run(velocity_[i]);
        }
    }

private:
    Vector3d measure() {
        const Vector3d z = world_.x.row(0).transpose() + random_.normal_vector(kNoise);
        (void)predictor_->correct(position_sample(t_, z));
        return z;
    }
    void compare(std::size_t i, const AxisColumns& truth) {
        const PosePrediction ahead = predictor_->predict(kLeads[i]);
        const PoseCovariance p = *predictor_->covariance(kLeads[i]);
        position_[i].push_back(square(truth.row(0).transpose() - ahead.position, p.position));
        velocity_[i].push_back(square(truth.row(1).transpose() - ahead.velocity, p.velocity));
    }

    std::unique_ptr<Predictor> predictor_;
    bool uneven_;
    RandomStream& random_;
    World world_;
    double t_ = 3, last_dt_ = kPeriod;
    std::vector<double> innovation_;
    std::array<std::vector<double>, 3> position_, velocity_;
};

Squares squares_of(const Case& c, std::size_t runs, std::size_t steps, bool uneven) {
    Squares squares;
    RandomStream random(mixed_seed(5, uneven, steps));
    for (std::size_t i = 0; i < runs; ++i) {
        Run run(c, uneven, random);
        for (std::size_t k = 0; k < steps; ++k) run.step();
        run.add_to(squares);
    }
    return squares;
}

// The checks of a test are some eighty: 3.4 standard errors each are 95 % for all of them together. Of 100
// steps, whose neighbours are correlated (as 50 independent ones), 95 inside their bounds are expected; 85
// are 3 deviations less.
TEST(Consistency, InnovationsAndErrorsAreAsLargeAsStatedAtConstantAndUnevenSteps) {
    for (const Case& c : kExact)
        for (const bool uneven : {false, true})
            squares_of(c, 200, 100, uneven)
                .expect_honest(c.specification + (uneven ? " uneven" : ""), 3.4, 0.85);
}

// Each of five steps falls outside at 5 %: two of them at once would be rare.
TEST(Consistency, FirstFiveSamplesAreAsUncertainAsStated) {
    for (const Case& c : kExact)
        squares_of(c, 2000, 5, true).expect_honest(c.specification + " start", 3.3, 0.8);
}

TEST(Consistency, InteractingModelsThatDoNotSwitchAreExactMixtures) {
    const Case slow{"imm:alpha=3,q1=1e9,q2=3e10,q3=1e12,rate=0.001", kImm.models};
    // Mixtures of chi-squares spread more than the bounds of one.
    squares_of(slow, 500, 100, true).expect_honest("imm, modes that last", 3.3, 0.85);
}

// An interacting filter replaces 3^k histories by three Gaussians, which is never exact; nor are errors of
// mixtures distributed as chi-square. Its statement must be right to a fifth.
TEST(Consistency, InteractingModelsStateErrorsOfTheirOwnSwitchingProcessToAFifth) {
    for (const bool uneven : {false, true})
        squares_of(kImm, 500, 100, uneven)
            .expect_near(uneven ? "imm, switching, uneven" : "imm, switching", 0.2);
}

// The truth is one of its models; which one, the innovations of the last 32 samples tell only in part.
TEST(Consistency, BankStatesErrorsOfItsChosenModelToATwentieth) {
    const std::vector<LinearMotion> models = {{2, 0, 1e1}, {3, 0, 3e2}, {3, 30, 1e5}};
    for (const char* name : {"bank", "bank:score=likelihood"})
        for (const bool uneven : {false, true})
            squares_of({name, models}, 600, 100, uneven)
                .expect_near(name + std::string(uneven ? " uneven" : ""), 0.05);
}

/// Orientations: the same process for a rotation vector about the current orientation, in radians of a lever
/// kLever long.
std::vector<double> rotation_squares(const Case& c, double lead, std::size_t steps, RandomStream& random) {
    const auto predictor = make_predictor(with_start(c.specification));
    World world = c.start(random);
    world.x.row(0).setZero();
    Quaterniond q = exponential(random.normal_vector(1));
    const auto turned = [](const Quaterniond& from, const World& by) {
        return Quaterniond(exponential(by.x.row(0).transpose() / kLever) * from);
    };
    std::vector<double> squares;
    for (std::size_t k = 0; k <= steps; ++k) {
        PoseSample sample = position_sample(static_cast<double>(k) * kPeriod, Vector3d::Zero());
        sample.has_orientation = true;
        sample.orientation = exponential(random.normal_vector(kNoise / kLever)) * q;
        (void)predictor->correct(sample);
        const Quaterniond truth = turned(q, world.after(lead, kPeriod, random));
        if (k > 0)
            squares.push_back(square(logarithm(truth * predictor->predict(lead).orientation.conjugate()),
                                     predictor->covariance(lead)->rotation));
        world.advance(kPeriod, random);
        q = turned(q, world);
        world.x.row(0).setZero();
    }
    return squares;
}

// Densities of a hundredth, so that predicted errors are small against 1 rad, as the filter takes them to be.
// It also leaves out that the effect of a rate's error shrinks while q turns by theta, to sin(theta/2) /
// (theta/2) across the axis: squares of 0.9 to 0.95 at the 12 rad/s and 1/15 s reached here.
TEST(Consistency, ErrorsOfOrientationsAreAsLargeAsStatedWhileTheyAreSmall) {
    const Case cases[] = {{"cv:q=1e6", {{2, 0, 1}}},
                          {"ca:q=1e7", {{3, 0, 1e1}}},
                          {"singer:alpha=3,q=1e8", {{3, 3, 1e2}}},
                          {"singer:alpha=30,q=1e9", {{3, 30, 1e3}}}};
    for (const Case& c : cases) {
        Squares squares;
        RandomStream random(11);
        for (const double lead : kLeads) {
            squares.quantities.push_back({"rotation", lead, NormalisedSquares(30)});
            for (int run = 0; run < 500; ++run)
                squares.quantities.back().squares.add_run(rotation_squares(c, lead, 30, random));
        }
        squares.expect_near(c.specification + " rotation", 0.08);
    }
}

}  // namespace
}  // namespace tracking
