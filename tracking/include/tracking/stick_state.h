#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "tracking/motion.h"
#include "tracking/newest_value.h"

namespace tracking {

/// What the filters of one stick know after its newest sample. Copied bit by bit, also through shared memory
/// between processes (NewestValue). Times: `_s` on the clock of the sample (a trace's own; seconds since the
/// epoch for live sources), `_ns` on CLOCK_MONOTONIC, which all processes of a machine share, 0 offline.
struct StickState {
    /// To be counted up with each change of this layout: processes that share it check that they agree.
    static constexpr std::uint64_t kVersion = 4;
    static constexpr std::size_t kMostModels = 3;

    std::uint64_t samples =
        0;  ///< accepted since the run began, and those of a trace that were due while its sensor process
            ///< was started again: a larger number is a newer state; 0: none yet
    std::uint64_t starts = 0;   ///< how often the sound's filter started anew (the first sample counts)
    std::uint64_t refused = 0;  ///< samples that the filters ignored
    std::uint64_t lap = 0;      ///< how often a looped trace has begun again
    double t_s = 0;             ///< of the newest accepted sample, within its lap
    std::int64_t due_ns = 0;    ///< when that sample was taken (live: its own time plus the clocks' offset)
    std::int64_t read_ns = 0;   ///< when the reader got it
    std::int64_t filtered_ns = 0;  ///< when the filters were done, just before publication
    Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< measured, of the tracked body [m]
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    std::uint64_t oriented = 0;  ///< 1: the sample says the orientation
    PosePath picture, sound;     ///< of the filters for pictures and for sound
    Motion confirming;           ///< of the filter that confirms strikes, where there is one
    std::uint64_t confirms = 0;  ///< 1: there is one
    /// Time of the newest sample that the filters for pictures and for confirmation took; t_s, unless their
    /// gates refused that one.
    double picture_t_s = 0, confirming_t_s = 0;
    /// How many models the sound's filter runs in parallel, which it has selected (`sound` is its), and, of
    /// several, what each of them expects.
    std::uint64_t models = 1, model = 0;
    std::array<Motion, kMostModels> sound_models;
};

/// Numbers and arrays of numbers.
template <>
inline constexpr bool kCopiesAsBytes<StickState> = true;

}  // namespace tracking
