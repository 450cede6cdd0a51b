#include "play/play_products.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "play/note_of_strike.h"
#include "play/play_setup.h"
#include "process/child_process.h"
#include "strikes/score_strikes.h"
#include "strikes/true_contacts.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kApartS = 0.5;  // between the notes whose frames the report shows

}  // namespace

void score(PlayResult& result, const Kit& kit, const StickGeometry& stick) {
    const std::vector<sim::BodyDefinition> bodies = bodies_of(kit);
    result.contacts = find_true_contacts(result.tracks, bodies, stick.radius_m);
    result.score = score_strikes(result.strikes, result.contacts);
    count_turns(result.score, result.strikes, result.contacts, result.tracks, bodies, stick.radius_m,
                result.release_margin_s);
}

void write_hits(const fs::path& file, const PlayResult& result, const Kit& kit) {
    std::vector<audio::Note> notes;
    for (const Strike& strike : result.strikes)
        if (strike.outcome == Outcome::released)
            notes.push_back(note_of(strike, kit.instruments[strike.instrument]));
    std::stable_sort(notes.begin(), notes.end(), [](const audio::Note& a, const audio::Note& b) {
        return a.onset_sample < b.onset_sample;
    });
    audio::write_midi(file, notes);
}

std::vector<fs::path> frames_to_show(const PlayResult& result, const fs::path& folder) {
    std::vector<const Strike*> loudest;
    for (const Strike& strike : result.strikes)
        if (strike.outcome == Outcome::released) loudest.push_back(&strike);
    std::stable_sort(loudest.begin(), loudest.end(),
                     [](const Strike* a, const Strike* b) { return a->speed_mps > b->speed_mps; });
    std::vector<const Strike*> shown;
    for (const Strike* strike : loudest) {
        const bool apart = shown.empty() || std::abs(strike->onset_s - shown.front()->onset_s) > kApartS;
        if (apart && shown.size() < 2) shown.push_back(strike);
    }
    std::vector<fs::path> files;
    for (const Strike* strike : shown) {
        const auto at = static_cast<long>(std::ceil((strike->onset_s - result.t0_s) * result.fps));
        for (const long k : {at - 2, at, at + 2})
            if (k >= 0 && k < static_cast<long>(result.frames))
                files.push_back(folder / fmt::format("{:06}.png", k));
    }
    return files;
}

}  // namespace app
