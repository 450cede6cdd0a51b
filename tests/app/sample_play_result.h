#pragma once
#include <array>
#include <cmath>
#include <string>

#include "kit/kit.h"
#include "play/play.h"
#include "temporary_folder.h"

/// A small finished run for the tests of its outputs: two sticks, three instruments, four strikes (one false,
/// one cancelled), three contacts (one missed), a second and a half of sound. Names hold everything that a
/// format has to quote or escape.
inline app::PlayResult sample_play_result() {
    app::PlayResult r;
    r.trace = "traces/a,b <take> \"1\".csv";
    r.options.kit = "kits/drums.toml";
    r.kit_name = "drums & bells";
    r.trace_source = "synthetic";
    r.options.picture_predictor = "cv";
    r.options.sound_predictor = "ca:q=1e9,gate=5";
    r.t0_s = 0.1;
    r.t_end_s = 1.1;
    r.options.render_lead_s = 1.0 / 30;
    r.options.sound_lead_s = 1.0 / 15;
    r.options.release_margin_s = 0.01;
    r.frames = 30;
    r.sticks = {"left", "right"};
    r.instruments = {"snare", "tom, \"low\"", "it's <b>crash</b>"};
    const auto strike = [&](std::uint32_t stick, std::uint32_t instrument, app::Outcome outcome,
                            std::int64_t sample) {
        app::Strike s;
        s.id = r.strikes.size() + 1;
        s.stick = stick;
        s.instrument = instrument;
        s.outcome = outcome;
        s.onset_sample = sample;
        s.onset_s = r.t0_s + static_cast<double>(sample) / 48000;
        s.speed_mps = 1.0 / 3 + static_cast<double>(s.id);
        s.point_world = {0.1 + 0.2, 0.8, -1e-7};
        s.scheduled_at_s = s.onset_s - 0.06;
        s.decided_at_s = s.onset_s - 0.01;
        s.moves = static_cast<int>(s.id) - 1;
        r.strikes.push_back(s);
    };
    strike(0, 0, app::Outcome::released, 9600);
    strike(1, 1, app::Outcome::released, 19200);
    strike(0, 2, app::Outcome::cancelled, 24001);
    strike(1, 2, app::Outcome::released, 33600);
    const auto contact = [&](double t_s, std::uint32_t stick, std::uint32_t instrument, std::uint64_t id) {
        r.contacts.push_back({t_s, stick, instrument, 2.5, {0.3, 0.81, 0.02}, id});
    };
    contact(0.298, 0, 0, 1);
    contact(0.504, 1, 1, 2);
    contact(0.9, 0, 2, 0);
    r.score = {3, 3, 1, 2, 1, 1, 0, 1, 3.0, 4.0};
    for (const std::string& name : r.sticks) {
        app::TipTrack track{name, {}, {}};
        for (int i = 0; i <= 120; ++i) {
            track.t_s.push_back(r.t0_s + i / 120.0);
            track.tip.emplace_back(0.3, 0.9 + 0.1 * std::cos(i * 0.26 + (name == "left" ? 0 : 2)), 0.02);
        }
        r.tracks.push_back(track);
    }
    for (int i = 0; i < 72000; ++i) {
        const float sample =
            0.5F * std::sin(static_cast<float>(i) * 0.05F) * std::exp(-static_cast<float>(i) / 20000);
        r.sound.samples.append(std::array{sample, 0.5F * sample});
    }
    r.wall_s = 0.5;
    r.stages_s = {{"tracking", 0.1}, {"drawing", 0.3}};
    r.options.workers = 1;
    r.origin.inputs = {{r.trace, std::string(64, 'a')}, {r.options.kit.string(), std::string(64, 'b')}};
    r.origin.fingerprint = "0123456789abcdef";
    r.origin.versions = {{"csound", "6.18"}};
    return r;
}
