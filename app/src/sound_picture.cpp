#include "sound_picture.h"

#include <algorithm>
#include <cmath>

#include "drawn_path.h"

namespace app {

std::vector<SoundPicture> sound_and_picture(std::span<const Strike> strikes, const RealtimeResult& realtime,
                                            const Kit& kit, double tip_radius_m) {
    const DrawnPaths paths = drawn_paths(realtime.tips);
    std::vector<SoundPicture> matched;
    for (std::size_t i = 0; i < realtime.notes.size(); ++i) {
        const NoteTiming& note = realtime.notes[i];
        const Strike& strike = strikes[note.strike];
        const auto path = paths.find({strike.stick, note.lap});
        if (path == paths.end()) continue;
        const sim::BodyDefinition& body = kit.instruments[strike.instrument].body;
        SoundPicture found{i, strike.onset_s + note.late_s, 0, std::nullopt};
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
