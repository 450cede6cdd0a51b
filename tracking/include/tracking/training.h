#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "tracking/path_model.h"
#include "tracking/trace.h"

namespace tracking {

/// One stick of a recording to learn from.
struct TrainingStick {
    StickTrace stick;
    Eigen::Vector3d shaft = -Eigen::Vector3d::UnitZ();  ///< unit, hand to tip, in the body's frame
    Eigen::Vector3d tip = Eigen::Vector3d::Zero();      ///< in the body's frame [m]
    /// Times that nothing is learned from, within 50 ms: of untrusted positions and orientations [s], ascending.
    std::vector<double> flagged_s, flagged_rotations_s;
    std::size_t recording = 0;  ///< that it is of: each counts by the root of its length, whatever its speed
    bool held_out = false;      ///< for validation: nothing is learned from it
};

struct TrainingOptions {
    std::size_t hidden = 64;    ///< units of each of the two hidden layers
    std::size_t steps = 60000;  ///< at most
    std::uint64_t seed = 1;
    bool contacts = true;  ///< also learn the network of contacts
    /// Gets the share done and the validation error; false stops. May be empty.
    std::function<bool(double, double)> progress;
};

/// RMS errors on the sticks held out, 60 Hz with 0.25 mm of noise, without flagged times.
struct TrainingScore {
    double lead_s = 0;
    double with_shaft_mm = 0, position_only_mm = 0;  ///< of the tracked point
    double fading_mm = 0;                            ///< of the fading velocity that the network adds to
    double inside_50 = 0, inside_95 = 0;             ///< share of the errors within the stated regions
};

struct TrainingResult {
    PathModel model;  ///< without provenance
    std::vector<TrainingScore> scores;
    std::size_t examples = 0, steps = 0;
    std::size_t contact_examples = 0, contact_steps = 0;
    /// Of the network of contacts, held out: the mean of -ln(probability of what came), and that of a network
    /// which knows only how often each outcome comes.
    double contact_loss = 0, contact_loss_of_shares = 0;
};

/// Learns to predict the path of a stick from its last 0.25 s.
///
/// Each recording is seen several times, by sensors of 30 to 150 Hz, with and without jitter, drop-outs and
/// orientation, played faster or slower (by up to 30 %) and mirrored; the truth is the noiseless recording.
/// What is learned, at five leads to 0.15 s at once, is the residual of the fading velocity in the frame and unit
/// of the recent motion (StickHistory). The loss is the squared residual over the fading velocity's mean square at
/// that lead, summed over leads for position and, by half, for the shaft; examples count in proportion to
/// their speed, over what the fading velocity has on average in their recording. To it comes, with a weight of 0.05,
/// the negative logarithm of the likelihood of normal errors of the covariance that the network states, by
/// which the residual itself is not moved. Adam (Kingma and Ba 2015) with decoupled weight decay (Loshchilov and
/// Hutter 2019), its rate falling as a cosine. The weights that did best on the sticks held out are kept; training
/// ends when these have not got better for a third of the steps. Last, the covariances are scaled for each lead so
/// that the regions of 50 and 95 % hold of the held-out errors what they say, as nearly as one factor can.
///
/// Then, if asked, the network of contacts (PathModel::contacts) is learned from the same recordings. It is left out of the model
/// unless its held-out loss is below 0.7 of what the shares of the outcomes alone have.
///
/// A pure function of its arguments, one thread; bit-identical for one build on one kind of processor (Eigen's
/// products of matrices are parted to fit its caches). Throws
/// std::invalid_argument where there is nothing to learn from or nothing held out.
[[nodiscard]] TrainingResult train_path_model(std::span<const TrainingStick> sticks,
                                              const TrainingOptions& options);

}  // namespace tracking
