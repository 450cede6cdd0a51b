// Filters on data simulated from their own models: innovations and errors must be as large as the filter
// says (Bar-Shalom, Li, Kirubarajan 2001, section 5.4).
#include <gtest/gtest.h>

#include <cstdio>

#include "rotation.h"
#include "simulated_motion.h"
#include "tracking/predictor.h"

namespace tracking {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kNoise = 0.25e-3;   // r=0.25
constexpr double kV0 = 1, kA0 = 10;  // v0=1000 and the default a0=1e4
constexpr std::array<double, 3> kLeads = {0, 1.0 / 30, 1.0 / 15};
constexpr double kStep = 1.0 / 60;

/// A start whose spread the filter is told: the first sample's own noise for the position.
const std::string kStart = "r=0.25,p0=0.25,v0=1000";

struct Case {
    std::string specification;
    std::vector<LinearMotion> models;
    double rate = 0;

    [[nodiscard]] World start(RandomStream& random) const {
        World world{models, rate, 0, normal_columns(random)};
        if (models.size() > 1) world.mode = static_cast<std::size_t>(2.999 * random.uniform());
        world.x.row(1) *= kV0;
        world.x.row(2) *= models[0].order == 2 ? 0 : kA0;
        return world;
    }
};

const Case kExact[] = {{"cv:q=1e8", {{2, 0, 1e2}}},
                       {"ca:q=1e9", {{3, 0, 1e3}}},
                       {"singer:alpha=3,q=1e10", {{3, 3, 1e4}}},
                       {"singer:alpha=30,q=1e11", {{3, 30, 1e5}}}};
const Case kThesis = {"thesis", {{3, 0, 0, Vector3d(1e-3, 20e-3, 63e-3)}}};
const Case kImm = {"imm:alpha=3,q1=1e9,q2=3e10,q3=1e12,rate=10",
                   {{3, 3, 1e3}, {3, 3, 3e4}, {3, 3, 1e6}},
                   10};

double step_length(bool uneven, RandomStream& random) {
    return uneven ? 0.002 + 0.03 * random.uniform() : kStep;
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

    /// Prints the mean furthest from 1, in its standard errors, and the least share of steps inside.
    void expect_honest(const std::string& of, double deviations, double least_share) const {
        double furthest = 0, least = 1, mean_there = 1;
        for (const Quantity& q : quantities) {
            const double off = (q.squares.mean() - 1) / q.squares.standard_error();
            if (std::abs(off) > std::abs(furthest)) furthest = off, mean_there = q.squares.mean();
            least = std::min(least, q.squares.share_inside());
            EXPECT_LE(std::abs(off), deviations)
                << of << ": " << q.name << " at lead " << q.lead << ": mean " << q.squares.mean() << " +- "
                << q.squares.standard_error();
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
        : predictor_(make_predictor(of.specification + (of.specification.find(':') == std::string::npos ? ":" : ",") + kStart)),
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
    double t_ = 3, last_dt_ = kStep;
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

// The checks of a test are some fifty: 3.3 standard errors each are 95 % for all of them together. Of 100
// steps, whose neighbours are correlated, 95 inside their bounds are expected; 88 are 3 deviations less.
TEST(Consistency, InnovationsAndErrorsAreAsLargeAsStatedAtConstantAndUnevenSteps) {
    for (const Case& c : kExact)
        for (const bool uneven : {false, true})
            squares_of(c, 200, 100, uneven).expect_honest(c.specification + (uneven ? " uneven" : ""), 3.3, 0.88);
}

// Each of five steps falls outside at 5 %: two of them at once would be rare.
TEST(Consistency, FirstFiveSamplesAreAsUncertainAsStated) {
    for (const Case& c : kExact)
        squares_of(c, 2000, 5, true).expect_honest(c.specification + " start", 3.3, 0.8);
}

TEST(Consistency, Thesis) {
        for (const bool uneven : {false, true})
    squares_of(kThesis, 200, 100, uneven).expect_honest("thesis", 3.3, 0.88);
}
TEST(Consistency, Imm) {
        for (const bool uneven : {false, true})
    squares_of(kImm, 500, 100, uneven).expect_honest("imm", 3.3, 0.88);
    squares_of(kImm, 500, 5, true).expect_honest("imm", 3.3, 0.88);
}
TEST(Consistency, Bank) {
    for (const char* name : {"bank", "bank:score=likelihood"})
        for (const LinearMotion& m : {LinearMotion{2, 0, 1e1}, LinearMotion{3, 0, 3e2}, LinearMotion{3, 30, 1e5}})
            squares_of({name, {m}}, 500, 100, false).expect_honest(name, 3.3, 0.88);
}

}  // namespace
}  // namespace tracking
