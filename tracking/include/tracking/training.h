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
    std::size_t recording = 0;  ///< number of its recording: each is weighted by the root of its length
    bool held_out = false;      ///< nothing that is scored was learned from it
};

struct TrainingOptions {
    std::size_t hidden = 64;    ///< units of each of the two hidden layers
    std::size_t steps = 20000;  ///< of each of the two trainings
    std::uint64_t seed = 1;
    bool contacts = true;  ///< also learn the network of contacts
    /// Gets the share done; false stops, with what was learned so far. May be empty.
    std::function<bool(double)> progress;
};

/// RMS errors on the sticks held out, of a network that has not learned from them, 60 Hz with 0.25 mm of noise, without flagged times.
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
    /// Held-out cross entropy of the network of contacts, and of a constant answer: the frequency of each
    /// outcome.
    double contact_loss = 0, contact_loss_of_shares = 0;
};

/// Learns to predict the path of a stick from its last 0.25 s.
///
/// Each recording is augmented 30 times: by sensors of 30 to 150 Hz, with and without jitter, drop-outs and
/// orientation, slower and faster, greater and smaller, tilted (random_sighting()) and mirrored; the truth is
/// what a noiseless sensor would have seen. Without augmentation a network overfits to the few strokes of a
/// recording. What is learned, at five leads to 0.15 s at once, is the residual of the fading velocity in the
/// frame and unit of the recent motion (StickHistory). The loss is the squared residual over the fading
/// velocity's mean square at that lead, summed over leads for position and, by half, for the shaft. Examples
/// are weighted by their squared speed, so that errors count in metres, over the mean of the fading
/// velocity's errors in their recording. Added with a weight of 0.05 is the negative log-likelihood of the
/// errors under the covariance that the network states; its gradient does not reach the residual. Adam
/// (Kingma and Ba 2015) with decoupled weight decay (Loshchilov and Hutter 2019), its rate falling as a
/// cosine; the last weights are kept.
///
/// That is done twice, with the same settings: first without the sticks held out, on which this network is
/// scored. On them the covariances are scaled for each lead, so that the regions of 50 and 95 % hold these
/// shares of the held-out errors as nearly as one factor allows. Then, for the model, it learns from all
/// sticks. So the scores are of sticks that were not learned from, and the model uses all recordings.
///
/// Last, if asked, the network of contacts (PathModel::contacts) is learned from the sticks that are not held
/// out. It is left out of the model unless its held-out loss is below 0.7 of that of the constant answer.
///
/// A pure function of its arguments, one thread; bit-identical for one build on one kind of processor
/// (Eigen's products of matrices are parted to fit its caches). Throws std::invalid_argument where there is
/// nothing to learn from or nothing held out.
[[nodiscard]] TrainingResult train_path_model(std::span<const TrainingStick> sticks,
                                              const TrainingOptions& options);

}  // namespace tracking
