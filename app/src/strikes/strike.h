#pragma once
#include <Eigen/Core>
#include <cstdint>

namespace app {

enum class Outcome { pending, released, cancelled };

/// One predicted contact of one stick with one instrument, from its first prediction to its release or
/// cancellation.
struct Strike {
    std::uint64_t id = 0;          ///< from 1, in order of first prediction
    std::uint32_t stick = 0;       ///< index into the trace's sticks
    std::uint32_t instrument = 0;  ///< index into the kit's instruments
    std::int32_t zone = 0;         ///< index into the instrument's zones
    std::uint32_t model = 0;       ///< the predictor's model that gave its newest time
    Outcome outcome = Outcome::pending;
    double contact_s = 0;                                     ///< predicted contact, trace clock
    std::int64_t onset_sample = 0;                            ///< of audio.wav
    double onset_s = 0;                                       ///< t0 + onset_sample / 48000
    double speed_mps = 0;                                     ///< inward normal speed at the contact
    Eigen::Vector3d point_world = Eigen::Vector3d::Zero();    ///< on the deformed surface [m]
    Eigen::Vector3d normal_world = Eigen::Vector3d::UnitY();  ///< outward there
    Eigen::Vector3d point_body = Eigen::Vector3d::Zero();     ///< in the rest shape [m]
    Eigen::Vector3d impulse_body = Eigen::Vector3d::Zero();   ///< [N s]
    double scheduled_at_s = 0;                                ///< sample of the first prediction
    double decided_at_s = 0;  ///< release point, or the sample that cancelled it
    int moves = 0;            ///< changes of onset or speed after the first
};

/// A contact of the recorded path with an instrument at rest; uses the whole recording, for scoring only.
struct TrueContact {
    double t_s = 0;
    std::uint32_t stick = 0, instrument = 0;
    double speed_mps = 0;
    Eigen::Vector3d point_world = Eigen::Vector3d::Zero();  ///< of the tip's centre [m]
    std::uint64_t matched_id = 0;                           ///< strike that sounded it; 0: missed
};

}  // namespace app
