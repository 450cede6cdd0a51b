#include "kit/kit.h"

namespace app {

StickGeometry stick_geometry(const tracking::Trace& trace, const StickDefinition& stick,
                             const std::optional<Eigen::Vector3d>& tip_option,
                             const std::optional<Eigen::Vector3d>& shaft_option) {
    StickGeometry geometry;
    geometry.radius_m = stick.radius_m;
    geometry.length_m = stick.length_m;
    geometry.tip = tip_option.value_or(stick.tip.value_or(trace.tip.value_or(geometry.tip)));
    geometry.shaft =
        shaft_option.value_or(stick.shaft.value_or(trace.shaft.value_or(geometry.shaft))).normalized();
    return geometry;
}

TipTrack tip_track(const tracking::StickTrace& stick, const StickGeometry& geometry) {
    TipTrack track{stick.name, {}, {}};
    track.t_s.reserve(stick.samples.size());
    track.tip.reserve(stick.samples.size());
    for (const tracking::PoseSample& sample : stick.samples) {
        track.t_s.push_back(sample.t_s);
        track.tip.push_back(sample.position + sample.orientation * geometry.tip);
    }
    return track;
}

std::vector<TipTrack> tip_tracks(const tracking::Trace& trace, const StickGeometry& geometry) {
    std::vector<TipTrack> tracks;
    for (const tracking::StickTrace& stick : trace.sticks) tracks.push_back(tip_track(stick, geometry));
    return tracks;
}

}  // namespace app
