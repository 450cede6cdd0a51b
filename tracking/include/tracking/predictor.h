#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tracking/motion.h"
#include "tracking/trace.h"

namespace tracking {

struct PathModel;

/// Squared radii of the 50 and 95 % regions of a normal error in three dimensions, in standard deviations.
inline constexpr double kRadius50 = 2.3659738843753377, kRadius95 = 7.814727903251179;

/// Covariance of the errors of a prediction as the estimator itself states it. World frame.
struct PoseCovariance {
    Eigen::Matrix3d position = Eigen::Matrix3d::Zero();  ///< [m^2]
    Eigen::Matrix3d velocity = Eigen::Matrix3d::Zero();  ///< [m^2/s^2]
    Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();  ///< of the small rotation from the predicted
                                                         ///< orientation to the true one [rad^2]
    /// Of the position: half of the errors e are to have e^T C^-1 e <= radius_50, 95 % <= radius_95. Those of a
    /// normal error, unless the estimator knows better.
    double radius_50 = kRadius50, radius_95 = kRadius95;
};

/// What became of a sample. `outlier`: only with a gate (`gate=`); the sample was ignored, but the
/// third in a row is taken as real and answers `reinitialised`.
enum class SampleStatus { accepted, not_newer, not_finite, reinitialised, outlier };
/// Whether a sample became part of an estimator's state.
[[nodiscard]] inline bool is_taken(SampleStatus status) {
    return status == SampleStatus::accepted || status == SampleStatus::reinitialised;
}

/// A causal estimator of one stick's pose. One thread at a time; correct() and predict() allocate nothing.
class Predictor {
public:
    virtual ~Predictor() = default;
    /// Takes the next sample. Samples that are not newer than the state, or not finite, are ignored and
    /// counted by the caller. After a gap longer than kGapS the state starts anew from
    /// this sample: `reinitialised` (the very first sample answers `reinitialised` too).
    [[nodiscard]] virtual SampleStatus correct(const PoseSample& sample) noexcept = 0;
    /// Pose `lead_s` >= 0 after the newest accepted sample; leaves the state alone.
    [[nodiscard]] virtual PosePrediction predict(double lead_s) const noexcept = 0;
    /// Time of the newest accepted sample [s].
    [[nodiscard]] virtual double time_s() const noexcept = 0;
    /// Covariance of predict(lead_s); none for estimators that state none.
    [[nodiscard]] virtual std::optional<PoseCovariance> covariance(double /*lead_s*/) const noexcept {
        return std::nullopt;
    }
    /// Whether predicted positions depend on orientations.
    [[nodiscard]] virtual bool heeds_orientation() const noexcept { return false; }
    /// What predict() depends on, as a value: motion()->after(lead_s) is predict(lead_s). None where a Motion
    /// cannot express it: polynomials of degree 3, external programs.
    [[nodiscard]] virtual std::optional<Motion> motion() const noexcept { return std::nullopt; }
    /// The same of model `index`, of several in parallel.
    [[nodiscard]] virtual std::optional<Motion> motion_of_model(std::size_t /*index*/) const noexcept {
        return motion();
    }

    /// Several models in parallel (3.25-3.28): their number, the one whose prediction predict() returns, and
    /// the prediction of model `index`. Most estimators have one model.
    [[nodiscard]] virtual std::size_t models() const noexcept { return 1; }
    [[nodiscard]] virtual std::size_t selected() const noexcept { return 0; }
    [[nodiscard]] virtual PosePrediction predict_model(std::size_t /*index*/, double lead_s) const noexcept {
        return predict(lead_s);
    }

    /// An estimator that runs in another process may fail, but correct() and predict() cannot throw: the
    /// failure is thrown here. To be called before a run's results are used.
    virtual void require_working() const {}
};

/// Feeds a sample to a predictor and returns how far the predictor's state then lies behind it [s]; 0 if the
/// predictor took it. What is expected `lead_s` after the sample is predict(lead_s + that), also where the
/// sample was refused. Throws as require_working() does.
[[nodiscard]] inline double feed(Predictor& predictor, const PoseSample& sample) {
    if (is_taken(predictor.correct(sample))) return 0;
    predictor.require_working();
    return std::max(0.0, sample.t_s - predictor.time_s());
}

/// Makes a predictor from its name and parameters in mm and s:
///
///   hold                    the newest sample
///   difference              the last two samples, extrapolated at constant velocity
///   naive, naive:n=4        mean of the last 1/15 s (or n samples) with the velocity of successive means
///   least-squares:degree=2,n=4            polynomial through the last n samples (n: degree + 2)
///   double-exponential:a=0.9              LaViola 2003
///   one-euro:min=10,beta=0.1,d=30         Casiez 2012 with its velocity; beta in Hz s/mm
///   thesis, thesis:q=outer  Kalman filter, constant acceleration, (3.18) as a diagonal, or as printed
///   cv:q=1e8                constant velocity, white acceleration of density q [mm^2/s^3]
///   cv:q=1e8,decay=10       velocity that decays at 10 /s (default 0: does not)
///   ca:q=1e9                constant acceleration, white jerk of density q [mm^2/s^5]
///   singer:alpha=3,q=1e10   acceleration that decays at alpha [1/s], driven by density q [mm^2/s^5]
///   bank:cv=1e7,ca=3e8,alpha=30,singer=1e11,lead=0.0667   the model that was right a lead ago (3.28);
///                           score=likelihood: most likely (3.27) instead of nearest
///   imm:alpha=200,q1=1e9,q2=3e10,q3=1e12,rate=10             interacting Singer models, switching at `rate`
///   surface:q=1e7,decay=8,r=0.5,gate=5    `cv` that rebounds at the height where strokes turn back, with a
///                           restitution that it learns; its angular velocity does not decay
///   learned                 a network, `model`, from the last 0.25 s: position, shaft, its own uncertainty
///   online:memory=100       that network; its last layer learns from each stick, and forgets over 100 s
///   arbitrated:memory=100,q=1e7,decay=8,r=0.5,gate=5         `surface` and `online`, weighted by their
///                           recent errors; with memory=0 `learned` in place of `online`
///
/// The numbers shown are the defaults. Orientation is filtered by the same model about its own quaternion.
/// thesis, cv, ca, singer, bank, imm, surface and arbitrated also take: `r=0.25`, the sensor's noise;
/// `p0=10`, `v0=1000`, `a0=1e4`, standard deviations of the start; `gate=G`: samples beyond G standard
/// deviations that a stick cannot have made (25 m/s, 3000 m/s^2, contacts excepted) are outliers. thesis, cv,
/// ca and singer take `steady=HZ`: the steady gain of that rate. `shaft`, a unit vector from hand to tip in
/// the tracked body's frame, is what learned, online and arbitrated follow; `model` is copied. Throws
/// std::invalid_argument with one line (found, expected) for an unknown name, key or value, and where there
/// is no model for what needs one.
[[nodiscard]] std::unique_ptr<Predictor> make_predictor(
    const std::string& specification, const Eigen::Vector3d& shaft = -Eigen::Vector3d::UnitZ(),
    const std::shared_ptr<const PathModel>& model = {});

/// The names make_predictor knows that need no model, and those that need one, in the order of the
/// documentation.
[[nodiscard]] const std::vector<std::string>& predictor_names();
[[nodiscard]] const std::vector<std::string>& model_predictor_names();

/// Position and velocity of a point fixed in the tracked body. `point_body` [m].
struct PointMotion {
    Eigen::Vector3d position, velocity;
};
[[nodiscard]] PointMotion point_of(const PosePrediction& pose, const Eigen::Vector3d& point_body) noexcept;

}  // namespace tracking
