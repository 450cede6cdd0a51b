#pragma once
#include <tracking/predictor.h>
#include <tracking/trace.h>

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "compare/recording.h"
#include "kit/kit.h"
#include "statistics/statistics.h"
#include "sticks/predictors.h"
#include "sticks/stick.h"
#include "strikes/contact_forecast.h"
#include "strikes/strike_decision.h"
#include "strikes/true_contacts.h"

namespace app {

/// Errors of one predictor at one lead; the RMS of each, in mm or degrees, is a figure of compare.json.
struct ErrorScore {
    SquareSum position;   ///< of the tracked point [mm]
    SquareSum free;       ///< likewise, truth outside +-50 ms of impacts and of flagged times
    SquareSum unflagged;  ///< likewise, sample and truth outside +-50 ms of flagged times
    SquareSum rotation;   ///< without flagged orientations [degrees]
    SquareSum tip;        ///< position and rotation together, at the tip; where rotations count [mm]
    std::vector<double> errors_mm;  ///< of the tracked point

    [[nodiscard]] double p95_mm() const { return quantile(errors_mm, 0.95); }
    void add(const tracking::PosePrediction& predicted, const Truth& truth, const Eigen::Vector3d& tip_body);
    /// Both together, as if one recording followed the other.
    void add(const ErrorScore& other);
};

/// How honest the stated covariances are; only of predictors that state one.
struct Calibration {
    std::size_t count = 0;     ///< predictions with a stated covariance
    std::size_t singular = 0;  ///< of these, not positive definite: not in the figures
    double inside_50 = 0,
           inside_95 = 0;  ///< share of position errors inside the stated 50 and 95 % ellipsoids
    double negative_log_likelihood = 0;  ///< mean, nats, positions in m
};
/// Both together, as if one recording followed the other.
void add(std::optional<Calibration>& sum, const std::optional<Calibration>& other);

/// The errors of predictions at one lead, as they are made.
struct LeadScore {
    ErrorScore error;
    Calibration sums;  ///< of what calibration() has the means of

    /// `covariance`: of the position [m^2], as the predictor states it; may be absent.
    void add(const tracking::PosePrediction& predicted, const Truth& truth, const Eigen::Vector3d& tip_body,
             const std::optional<tracking::PoseCovariance>& covariance);
    [[nodiscard]] std::optional<Calibration> calibration() const;
};

/// Gets each prediction that is scored, by sample and lead.
using SeePrediction = std::function<void(std::size_t, std::size_t, const tracking::PosePrediction&,
                                         const std::optional<tracking::PoseCovariance>&)>;

/// Errors of a predictor (fresh, fed here) at every lead of the stick, in one pass over its samples. A
/// prediction is for sample time + lead also where the predictor ignored the sample. `see` may be empty.
[[nodiscard]] std::vector<LeadScore> score_predictor(const SensedStick& stick, tracking::Predictor& predictor,
                                                     const SeePrediction& see = {});

/// The position errors alone [mm], for tuning and maps: orientation is not scored, and filtered only where the
/// positions depend on it.
[[nodiscard]] std::vector<SquareSum> score_positions(const SensedStick& stick,
                                                     tracking::Predictor& predictor);

/// What a stick strikes when predictors are compared: a horizontal plane, one for each stick, or a kit.
struct StrikeSurface {
    enum class Kind { none, plane, above_contact, kit } kind = Kind::none;
    double height_m = 0;  ///< plane: its height; above_contact: above the stick's contact height
    Kit kit;              ///< kit only
};

/// The strikes that a predictor commits `lead_s` ahead, against the true contacts of the recorded path.
struct HitScore {
    int true_contacts = 0, predicted = 0, matched = 0;
    int false_without_cancel = 0;          ///< committed notes without a contact when nothing is cancelled
    double minutes = 0;                    ///< of the recording
    std::vector<double> errors_ms;         ///< committed minus true time, signed, of the matched notes
    std::vector<StrikeDynamics> dynamics;  ///< likewise, of those whose contact goes inwards

    [[nodiscard]] int false_notes() const { return predicted - matched; }
    /// Shares; kNoValue when nothing was predicted, there was nothing to find, or both.
    [[nodiscard]] double precision() const { return share(matched, predicted); }
    [[nodiscard]] double recall() const { return share(matched, true_contacts); }
    [[nodiscard]] double f1() const { return share(2 * matched, true_contacts + predicted); }
    [[nodiscard]] double median_ms() const;  ///< of |error|; kNoValue when nothing matched
    [[nodiscard]] double p95_ms() const;
    /// Medians over the matched notes, of the sizes and, to see a bias, of the ratio itself [dB]; kNoValue likewise.
    [[nodiscard]] double speed_percent() const;
    [[nodiscard]] double speed_db() const;
    [[nodiscard]] double speed_bias_db() const;
    [[nodiscard]] double place_mm() const;
    [[nodiscard]] double false_per_min() const { return minutes > 0 ? false_notes() / minutes : 0; }
    [[nodiscard]] double false_per_min_without_cancel() const {
        return minutes > 0 ? false_without_cancel / minutes : 0;
    }
    /// What the strikes cost: 1 for each missed contact and each false note, |error| / 60 ms for the others
    /// (a note at the edge of the 30 ms window is half a miss).
    [[nodiscard]] double loss() const;
    /// Both together, as if one recording followed the other.
    void add(const HitScore& other);

private:
    [[nodiscard]] static double share(int part, int whole) {
        return whole > 0 ? static_cast<double>(part) / whole : kNoValue;
    }
};

/// The predictors that decide when a stick strikes.
struct StrikePredictors {
    tracking::Predictor& timing;                ///< whose path is swept
    tracking::Predictor* confirming = nullptr;  ///< must confirm near contacts (keep_confirmed); may be none
    const ContactForecast* network =
        nullptr;            ///< a second forecast of contacts (StrikeDecision); may be none
    double false_cost = 1;  ///< of a false sound; that of a missed strike is 1 (StrikeDecision)
};

/// A strike is cancelled until this long before its time.
inline constexpr double kReleaseMarginS = 0.010;

struct StrikeTiming {
    double lead_s = 1.0 / 15;  ///< a strike's time is fixed this long before
    double advance_s = 0;      ///< predicted contacts are taken to come earlier by this
};

/// The leads at which evaluate_strikes asks the timing predictor: 0 to a little beyond the strike's lead.
/// External predictors get these.
[[nodiscard]] std::vector<double> strike_leads(const StrikeTiming& timing);

/// Scores the strikes of one stick. At each sample the predicted path, until a little beyond the lead, is
/// swept against the surface. Each sample may move a contact in time, until the lead before it; then its time
/// is fixed. The contact may be cancelled, and taken up again, until kReleaseMarginS before it
/// (StrikeScheduler, as in `play`). Without cancelling every contact whose time was fixed is played. The true
/// contacts are those of the recorded path, straight between samples, 3 mm deep. A pure function, except with
/// `exec:` predictors that keep a state.
///
///   recorded    the tip's path as recorded, for the truth
///   samples     what the sensor reports, in order of arrival
///   predictors  made by the caller for this run; fed from their start
[[nodiscard]] HitScore evaluate_strikes(const TipTrack& recorded,
                                        std::span<const tracking::PoseSample> samples,
                                        const StrikePredictors& predictors, const StickGeometry& geometry,
                                        const StrikeSurface& surface, const StrikeTiming& timing);

}  // namespace app
