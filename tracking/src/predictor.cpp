#include "tracking/predictor.h"

#include <array>
#include <cmath>

#include "extrapolators.h"
#include "kalman_predictor.h"
#include "specification.h"
#include "text_cursor.h"

namespace tracking {
namespace {

constexpr double kSquareMetres = 1e-6;  // a mm^2; the parameters are in mm
constexpr double kLeastDensity = 1e-6;
constexpr double kMostDensity = 1e18;

std::unique_ptr<Predictor> make_kalman(Specification& specification, const MotionModel& model) {
    return std::make_unique<KalmanPredictor>(model, specification.number("gate", 0, 1, 1000));
}

double density(Specification& specification, double otherwise) {
    return kSquareMetres * specification.number("q", otherwise, kLeastDensity, kMostDensity);
}

std::unique_ptr<Predictor> make_hold(Specification&) {
    return std::make_unique<Hold>();
}

std::unique_ptr<Predictor> make_naive(Specification& specification) {
    constexpr double kWindow = 1.0 / 15;
    const double n = specification.number("n", 0, 1, MovingAverage::kCapacity);
    if (n != std::floor(n)) specification.fail("n that is not whole", "a whole number of samples");
    return n > 0 ? MovingAverage::of_count(static_cast<std::size_t>(n)) : MovingAverage::of_window(kWindow);
}

std::unique_ptr<Predictor> make_difference(Specification&) {
    return std::make_unique<Difference>();
}

std::unique_ptr<Predictor> make_thesis(Specification& specification) {
    const Eigen::Vector3d xi = Eigen::Vector3d(1, 20, 63) * 1e-3;  // (3.18)
    const bool outer = specification.word("q", "outer");
    const Eigen::Matrix3d full = xi * xi.transpose();
    const Eigen::Matrix3d diagonal = full.diagonal().asDiagonal();
    return make_kalman(specification, {MotionModel::FixedStep{outer ? full : diagonal}});
}

std::unique_ptr<Predictor> make_cv(Specification& specification) {
    MotionModel model{MotionModel::ConstantVelocity{density(specification, 1e8)}};
    model.initial_variance.z() = 0;
    return make_kalman(specification, model);
}

std::unique_ptr<Predictor> make_ca(Specification& specification) {
    return make_kalman(specification, {MotionModel::ConstantAcceleration{density(specification, 1e9)}});
}

std::unique_ptr<Predictor> make_singer(Specification& specification) {
    const double alpha = specification.number("alpha", 3, 1e-3, 1000);
    return make_kalman(specification, {MotionModel::Singer{alpha, density(specification, 1e10)}});
}

struct Entry {
    const char* name;
    std::unique_ptr<Predictor> (*make)(Specification&);
};

constexpr std::array<Entry, 7> kPredictors = {{{"hold", make_hold},
                                               {"naive", make_naive},
                                               {"difference", make_difference},
                                               {"thesis", make_thesis},
                                               {"cv", make_cv},
                                               {"ca", make_ca},
                                               {"singer", make_singer}}};

}  // namespace

const std::vector<std::string>& predictor_names() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> all;
        for (const Entry& entry : kPredictors) all.emplace_back(entry.name);
        return all;
    }();
    return names;
}

std::unique_ptr<Predictor> make_predictor(const std::string& text) {
    Specification specification(text);
    std::string known;
    for (const Entry& entry : kPredictors) {
        if (specification.name() == entry.name) {
            std::unique_ptr<Predictor> predictor = entry.make(specification);
            specification.require_no_others();
            return predictor;
        }
        known += std::string(known.empty() ? "" : ", ") + entry.name;
    }
    specification.fail("name " + in_quotes(specification.name()), "one of " + known);
}

PointMotion point_of(const PosePrediction& pose, const Eigen::Vector3d& point_body) noexcept {
    const Eigen::Vector3d arm = pose.orientation * point_body;
    return {pose.position + arm, pose.velocity + pose.angular_velocity.cross(arm)};
}

}  // namespace tracking
