#include "strikes/strike_note.h"

#include <audio/samples.h>

#include <algorithm>
#include <cmath>

namespace app {
namespace {

/// 0 at the centre of the struck zone, 1 at its edge: along a string, else by the radius about the body's
/// axis.
double place_of(const Strike& strike, const Instrument& instrument) {
    const Eigen::Vector3d unit = strike.point_body.cwiseQuotient(instrument.body.shape.semi_axes);
    if (instrument.kind == "string") return std::clamp(std::abs(unit.x()), 0.0, 1.0);
    const sim::Zone& zone = instrument.body.zones[static_cast<std::size_t>(strike.zone)];
    const double outer = std::min(1.0, zone.max_radius);
    const double radius = std::hypot(unit.x(), unit.z());
    return std::clamp((radius - zone.min_radius) / std::max(1e-6, outer - zone.min_radius), 0.0, 1.0);
}

}  // namespace

audio::Note note_of(const Strike& strike, const Instrument& instrument) {
    audio::Note note;
    note.id = strike.id;
    note.voice = strike.instrument;
    note.onset_sample = strike.onset_sample;
    note.speed_mps = 5 * std::pow(strike.speed_mps / 5, instrument.velocity_gamma);
    note.place = place_of(strike, instrument);
    note.zone = strike.zone;
    note.midi_note = instrument.zones[static_cast<std::size_t>(strike.zone)].midi_note;
    note.midi_velocity = audio::stroke_velocity(note.speed_mps);
    return note;
}

}  // namespace app
