#pragma once
#include <tracking/predictor.h>
#include <tracking/trace.h>

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "kit.h"
#include "tip_track.h"

namespace app {

/// What a stick strikes when predictors are compared: a horizontal plane, one for each stick, or a kit.
struct StrikeSurface {
    enum class Kind { none, plane, above_contact, kit } kind = Kind::none;
    double height_m = 0;  ///< plane: its height; above_contact: above the stick's contact height
    Kit kit;              ///< kit only
};

/// The strikes that a predictor commits `lead_s` ahead, against the true contacts of the recorded path.
struct HitScore {
    int true_contacts = 0, predicted = 0, matched = 0;
    int false_without_cancel = 0;   ///< committed notes without a contact when nothing is cancelled
    double minutes = 0;             ///< of the recording
    std::vector<double> errors_ms;  ///< committed minus true time, signed, of the matched notes

    [[nodiscard]] int false_notes() const { return predicted - matched; }
    [[nodiscard]] double precision() const;  ///< 1 when nothing was predicted
    [[nodiscard]] double recall() const;     ///< 1 when there was nothing to find
    [[nodiscard]] double f1() const;         ///< 2 matched / (true + predicted); 1 when both are 0
    [[nodiscard]] double median_ms() const;  ///< of |error|; 0 when nothing matched
    [[nodiscard]] double p95_ms() const;
    [[nodiscard]] double false_per_min() const;
    [[nodiscard]] double false_per_min_without_cancel() const;
    /// Both together, as if one recording followed the other.
    void add(const HitScore& other);
};

/// Strikes of one stick (the strike rules of the README): at each sample the path that the predictor states
/// for [0, lead_s + what has to be known] is swept against the surface; a contact's time is re-timed at each
/// sample until `lead_s` before it, then frozen; it may be cancelled until `release_margin_s` before it. The
/// true contacts are those of the recorded path, straight between samples, 3 mm deep. A pure function.
///
///   recorded  the stick as recorded, for the truth     samples  what the sensor reports, in order of arrival
///   predictor made by the caller for this run; fed from its start
[[nodiscard]] HitScore evaluate_strikes(const tracking::StickTrace& recorded,
                                        std::span<const tracking::PoseSample> samples,
                                        tracking::Predictor& predictor, const StickGeometry& geometry,
                                        const StrikeSurface& surface, double lead_s, double release_margin_s);

}  // namespace app
