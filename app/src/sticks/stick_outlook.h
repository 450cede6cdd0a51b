#pragma once
#include <sim/simulation.h>
#include <tracking/predictor.h>

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "kit/stick_geometry.h"

namespace app {

/// 0 to lead in eight equal pieces: the nodes of a predicted path.
[[nodiscard]] std::vector<double> path_leads(double lead_s);
/// 0 to lead in equal pieces.
[[nodiscard]] std::vector<double> leads_up_to(double lead_s, int pieces);

/// The path of the tip at those leads from a newest sample at `time_s`, of a pose by lead. None if it moves
/// as no stick can (samples that jump within microseconds): such a path makes no contact.
[[nodiscard]] std::optional<sim::TipPath> predicted_path(
    const std::function<tracking::PosePrediction(double)>& pose_after, double time_s,
    const StickGeometry& geometry, std::uint32_t stick, std::span<const double> leads_s);

/// How far beyond the newest sample a pose is predicted; later it is held [s].
inline constexpr double kLongestPredictionS = 0.15;
/// How far ahead the confirming path reaches [s].
inline constexpr double kConfirmingLeadS = 0.1;

/// What is known of one stick after its newest sample, and where it is expected to go: the questions that
/// strikes and pictures need, offline and in real time.
class StickOutlook {
public:
    StickOutlook(std::uint32_t stick, const StickGeometry& geometry) : stick_(stick), geometry_(geometry) {}
    virtual ~StickOutlook() = default;

    [[nodiscard]] std::uint32_t stick() const { return stick_; }
    [[nodiscard]] const StickGeometry& geometry() const { return geometry_; }
    void set_geometry(const StickGeometry& geometry) { geometry_ = geometry; }
    /// False before the first sample.
    [[nodiscard]] virtual bool started() const = 0;
    /// Centre of the tip in the newest sample that the filter took [m].
    [[nodiscard]] virtual const Eigen::Vector3d& measured_tip() const = 0;
    /// Whether a second filter confirms strikes.
    [[nodiscard]] virtual bool confirms() const = 0;
    /// Which of its models the sound's filter has selected.
    [[nodiscard]] virtual std::size_t selected_model() const = 0;
    /// How far ahead predicted_path() reaches [s].
    [[nodiscard]] virtual double sound_lead_s() const = 0;

    /// Pose for a picture shown at T >= the newest sample's time; a prediction is carried at most 0.15 s
    /// beyond that, then held.
    [[nodiscard]] tracking::PosePrediction pose_at(double T) const;
    /// The tip by the sound's filter at T, carried likewise.
    [[nodiscard]] tracking::PointMotion sounding_tip_at(double T) const;
    /// The path that the sound's filter predicts over [0, sound lead] from its newest sample, and the
    /// measured tip as a path that stands still.
    [[nodiscard]] sim::TipPath predicted_path() const;
    /// That of the filter which confirms strikes, where there is one.
    [[nodiscard]] std::optional<sim::TipPath> confirming_path() const;
    [[nodiscard]] sim::TipPath measured_path() const;

protected:
    /// Time of the newest sample of each filter, and its pose a lead later.
    [[nodiscard]] virtual double picture_time_s() const = 0;
    [[nodiscard]] virtual double sound_time_s() const = 0;
    [[nodiscard]] virtual double confirming_time_s() const = 0;
    [[nodiscard]] virtual tracking::PosePrediction picture_pose(double lead_s) const = 0;
    [[nodiscard]] virtual tracking::PosePrediction sound_pose(double lead_s) const = 0;
    [[nodiscard]] virtual tracking::PosePrediction confirming_pose(double lead_s) const = 0;

private:
    std::uint32_t stick_;
    StickGeometry geometry_;
};

}  // namespace app
