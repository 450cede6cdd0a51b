#include "latency/sound_picture.h"

#include <algorithm>
#include <cmath>

#include "latency/drawn_path.h"

namespace app {

double onset_in_lap_s(const NoteTiming& note, double t0_s, double period_s) {
    return t0_s + static_cast<double>(note.played.onset_sample) / audio::kSampleRate -
           static_cast<double>(note.lap) * period_s;
}

std::vector<SoundPicture> sound_and_picture(const PlayResult& play, const RealtimeResult& realtime,
                                            const Kit& kit, double tip_radius_m) {
    const DrawnPaths paths = drawn_paths(realtime.tips);
    std::vector<SoundPicture> matched;
    for (std::size_t i = 0; i < realtime.notes.size(); ++i) {
        const NoteTiming& note = realtime.notes[i];
        const Strike& strike = play.strikes[note.strike];
        const auto path = paths.find({strike.stick, note.lap});
        if (path == paths.end()) continue;
        const sim::BodyDefinition& body = kit.instruments[strike.instrument].body;
        SoundPicture found{i, onset_in_lap_s(note, play.t0_s, realtime.period_s), 0, std::nullopt};
        const std::vector<double> touches = path->second.touches(
            body, tip_radius_m, found.onset_s - kPictureWindowS, found.onset_s + kPictureWindowS);
        if (touches.empty()) continue;
        found.touch_s = *std::min_element(touches.begin(), touches.end(), [&](double a, double b) {
            return std::abs(a - found.onset_s) < std::abs(b - found.onset_s);
        });
        const DrawnTip* behind =
            path->second.first_behind(body, tip_radius_m, found.touch_s, found.touch_s + kPictureWindowS);
        if (behind != nullptr) found.frame_s = behind->t_s;
        matched.push_back(found);
    }
    return matched;
}

}  // namespace app
