#pragma once
#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "filter/kalman_predictor.h"
#include "learned/learned_path.h"
#include "tracking/trust.h"

namespace tracking {

/// Which of two predictions of a vector to trust, from the errors that they turned out to make.
///
///   p = F + a (M - F),  a = a* - u s,  0 <= a <= 1
///   a* = -sum w e_F.(M - F) / D,  D = sum w |M - F|^2,  w = exp(-age / 2 s)      (least squares)
///   s^2 = (sum w |e_F|^2 - a*^2 D) / (D n)                                       (its variance)
///
/// with n = 2 s / 0.15 s independent errors, fewer at the beginning: the share is what least squares is sure of, so
/// a model that helps by chance is not followed. a = 0 until errors of 0.25 s are known, and unless the RMS of e_M
/// over 10 s (weights exp(-age / 10 s)) is below 0.85 of that of e_F; u falls from 1 there to 0 where it is below 0.7: what has
/// long been right by far is not doubted for its last 2 s. Friedmann's choice of the model that was right (3.28), made continuous.
class Arbiter {
public:
    /// The predictions F and M of `truth`, which came `dt_s` after the truth before.
    void learn(const Eigen::Vector3d& filter, const Eigen::Vector3d& model, const Eigen::Vector3d& truth,
               double dt_s) noexcept;
    [[nodiscard]] double share() const noexcept { return share_; }

    /// What it has learned, and to go on from there.
    [[nodiscard]] const Trust::Sums& sums() const noexcept { return sums_; }
    void begin_with(const Trust::Sums& sums) noexcept;

private:
    void weigh() noexcept;

    Trust::Sums sums_;
    double share_ = 0;
};

/// What a stated covariance has to be multiplied by, and the squared radii of its regions of 50 and 95 %, learned
/// from the errors that turned out: errors of strokes are often small and rarely large, so no factor makes
/// the regions of a normal error hold both. The factor is the mean square, weighted by exp(-errors / 200); the logarithm
/// of each radius moves by a small step after each error (Robbins and Monro 1951), by longer ones at first.
class RegionScale {
public:
    using Radii = Trust::Radii;
    /// `square`: an error's squared distance in units of the covariance without this factor; `stated`: the radii()
    /// of the time when it was predicted, without which errors in a row would count as one.
    void learn(double square, const Radii& stated) noexcept;
    [[nodiscard]] const Radii& radii() const noexcept { return scale_.radii; }
    void apply(PoseCovariance& covariance) const noexcept;

    /// What it has learned, and to go on from there.
    [[nodiscard]] const Trust::Scale& scale() const noexcept { return scale_; }
    void begin_with(const Trust::Scale& scale) noexcept { scale_ = scale; }

private:
    Trust::Scale scale_;
};

/// Predictor `arbitrated`: a filter and a network that learns while the stick moves, weighed against each other for each lead, for the position
/// and for the shaft's direction (Arbiter). Starts as the filter, and is the filter wherever the network is
/// not clearly better. What it has learned of both outlasts gaps. Samples that the filter's gate refuses
/// reach neither.
///
/// Between the leads of the network shares are interpolated linearly; orientations are turned from the
/// filter's towards the network's by the share. The stated covariance of positions is (1 - a)^2 r^2 + a^2 C
/// with the covariance C that the network states and r 0.3 of the way at the recent speed; its scale and its regions are
/// for each lead what the errors turned out to be (RegionScale). Allocates when it is made only.
class Arbitrated final : public Predictor {
public:
    /// `memory_s`: of the network (Learned).
    Arbitrated(std::unique_ptr<Predictor> filter, const PathModel& model, const Eigen::Vector3d& shaft,
               double memory_s);

    [[nodiscard]] SampleStatus correct(const PoseSample& sample) noexcept override;
    [[nodiscard]] PosePrediction predict(double lead_s) const noexcept override;
    [[nodiscard]] double time_s() const noexcept override { return filter_->time_s(); }
    [[nodiscard]] std::optional<PoseCovariance> covariance(double lead_s) const noexcept override;
    [[nodiscard]] bool heeds_orientation() const noexcept override { return true; }
    [[nodiscard]] const Learned& learned() const noexcept { return learned_; }

    /// Of all leads; without the stick's name.
    [[nodiscard]] Trust trust() const;
    /// Before the first sample.
    void begin_with(const Trust& trust) noexcept;

private:
    /// Two predictions for one time, until it comes.
    struct Pending {
        double due_s = 0, share = 0;  // the share of the model in the position
        Eigen::Vector3d filter, model, filter_shaft, model_shaft;
        Eigen::Matrix3d covariance;
        RegionScale::Radii radii;
    };
    /// Those of one lead, oldest first.
    struct Lead {
        std::vector<Pending> ring;
        std::size_t first = 0, count = 0;
        double last_due_s = 0;
        Arbiter position, shaft;
        RegionScale regions;
    };
    /// Of a lead, from the shares at the network's leads; with the slope over the lead.
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
