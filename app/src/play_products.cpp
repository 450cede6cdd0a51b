#include "play_products.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "child_process.h"
#include "notes.h"
#include "play_setup.h"
#include "score_strikes.h"
#include "true_contacts.h"

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

void make_video(const fs::path& video, double fps, bool sound, const fs::path& staging) {
    std::vector<std::string> command = {"ffmpeg",
                                        "-nostdin",
                                        "-loglevel",
                                        "error",
                                        "-y",
                                        "-framerate",
                                        fmt::format("{}", fps),
                                        "-i",
                                        (staging / "frames" / "%06d.png").string()};
    if (sound) command.insert(command.end(), {"-i", (staging / "audio.wav").string(), "-c:a", "aac"});
    command.insert(command.end(), {"-c:v", "libx264", "-preset", "veryfast", "-pix_fmt", "yuv420p", "-fflags",
                                   "+bitexact", "-f", "mp4", video.string() + ".partial"});
    try {
        run_child(command, staging / "scratch" / "ffmpeg.log");
    } catch (...) {
        std::error_code ignored;
        fs::remove(video.string() + ".partial", ignored);
        throw;
    }
}

}  // namespace app
