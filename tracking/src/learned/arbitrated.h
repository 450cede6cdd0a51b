#pragma once
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "filter/kalman_predictor.h"
#include "learned/learned_path.h"
#include "tracking/trust.h"

namespace tracking {

/// Weighs two predictions F and M of a vector by their past errors e_F and e_M.
///
///   p = F + a (M - F),  a = a* - u s,  0 <= a <= 1
///   a* = -sum w e_F.(M - F) / D,  D = sum w |M - F|^2,  w = exp(-age / 2 s)      (least squares)
///   s^2 = (sum w |e_F|^2 - a*^2 D) / (D n)                                       (its variance)
///
/// with n = 2 s / 0.15 s independent errors, fewer at the beginning. The share a is a lower bound of the
/// estimate a*, so a model that helps by chance is not followed. a = 0 until errors of 0.25 s are known, and
/// unless the ratio of the RMS errors of M and F over 10 s (weights exp(-age / 10 s)) is below 0.85. u falls
/// from 1 at a ratio of 0.85 to 0 at 0.7: a model that has been much better for long needs no margin. A
/// continuous form of (3.28), Friedmann's choice of the model that was right.
class Arbiter {
public:
    /// The predictions F and M of `truth`, which came `dt_s` after the truth before.
    void learn(const Eigen::Vector3d& filter, const Eigen::Vector3d& model, const Eigen::Vector3d& truth,
               double dt_s) noexcept;
    [[nodiscard]] double share() const noexcept { return share_; }

    /// The state, to be saved, and to go on from.
    [[nodiscard]] const Trust::Sums& sums() const noexcept { return sums_; }
    void begin_with(const Trust::Sums& sums) noexcept;

private:
    void weigh() noexcept;

    Trust::Sums sums_;
    double share_ = 0;
};

/// Calibrates a stated covariance by the errors that are observed: a factor for the covariance, and the
/// squared radii of its regions of 50 and 95 %. Errors of strokes have heavy tails, so no factor alone makes
/// both regions of a normal distribution hold. The factor is the mean square, weighted by exp(-errors / 200).
/// The logarithm of each radius moves by a small step after each error (Robbins and Monro 1951); the first
/// steps are longer.
class RegionScale {
public:
    using Radii = Trust::Radii;
    /// `square`: an error's squared Mahalanobis distance, of the covariance without this factor; `stated`:
    /// the radii() when the prediction was made. (With the present ones, errors that follow each other would
    /// count as one.)
    void learn(double square, const Radii& stated) noexcept;
    [[nodiscard]] const Radii& radii() const noexcept { return scale_.radii; }
    void apply(PoseCovariance& covariance) const noexcept;

    /// The state, to be saved, and to go on from.
    [[nodiscard]] const Trust::Scale& scale() const noexcept { return scale_; }
    void begin_with(const Trust::Scale& scale) noexcept { scale_ = scale; }

private:
    Trust::Scale scale_;
};

/// Predictor `arbitrated`: a weighted mean of a filter and of a network that learns while the stick moves.
/// Each lead has its own weights, for the position and for the shaft's direction (Arbiter). It equals the
/// filter at the start and wherever the network is not clearly better. The weights outlast gaps. A sample
/// that the filter's gate refuses reaches neither.
///
/// Between the leads of the network shares are interpolated linearly; orientations are turned from the
/// filter's towards the network's by the share. The stated covariance of positions is (1 - a)^2 r^2 + a^2 C
/// with the covariance C that the network states and r 0.3 of the way at the recent speed; it is calibrated
/// for each lead (RegionScale). Allocates when it is made only.
class Arbitrated final : public Predictor {
public:
    /// `memory_s`: see Learned.
    Arbitrated(std::unique_ptr<Predictor> filter, const PathModel& model, const Eigen::Vector3d& shaft,
               double memory_s);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return filter_->time_s(); }
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override;
    [[nodiscard]] bool heeds_orientation() const noexcept override { return true; }
    [[nodiscard]] const Learned& learned() const noexcept { return learned_; }

    /// The state of all leads; without the stick's name.
    [[nodiscard]] Trust trust() const;
    /// Before the first sample.
    void begin_with(const Trust& trust) noexcept;

private:
    /// Both predictions for a time that has not come yet.
    struct Pending {
        double due_s = 0, share = 0;  // the share of the model in the position
        Eigen::Vector3d filter, model, filter_shaft, model_shaft;
        Eigen::Matrix3d covariance;
        RegionScale::Radii radii;
    };
    /// One lead: its pending predictions in a ring, oldest first, and what was learned from earlier ones.
    struct Lead {
        std::vector<Pending> ring;
        std::size_t first = 0, count = 0;
        double last_due_s = 0;
        Arbiter position, shaft;
        RegionScale regions;
    };
    /// The network's share at a lead, interpolated between the network's leads; with its slope over the lead.
    struct Share {
        double value = 0, slope = 0;
    };
    [[nodiscard]] Share share(double lead_s, Arbiter Lead::*of) const noexcept;
    [[nodiscard]] Eigen::Matrix3d unscaled(double lead_s, const PathSpreads& spreads) const noexcept;
    void judge(const PoseSample& sample) noexcept;
    void remember() noexcept;

    std::unique_ptr<Predictor> filter_;
    Learned learned_;
    Eigen::Vector3d shaft_;
    PoseSample newest_;
    bool oriented_ = false;
    std::array<Lead, kNodes> leads_;
};

}  // namespace tracking
