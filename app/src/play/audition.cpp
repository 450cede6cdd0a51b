#include "play/audition.h"

#include <audio/own_orchestra.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <stdexcept>

#include "files/bad_input.h"
#include "play/play_run.h"
#include "report/plot.h"
#include "strikes/strike_note.h"

namespace app {
namespace fs = std::filesystem;
namespace {

constexpr double kFirstS = 0.1, kLevelS = 0.1, kCutFadeS = 0.02;
constexpr int kBeginningSamples = 240;  // 5 ms

/// A stroke in the middle of a zone, at the top.
Strike stroke_at(const Instrument& instrument, std::uint32_t number, int zone) {
    const sim::Zone& there = instrument.body.zones[static_cast<std::size_t>(zone)];
    const Eigen::Vector3d& half = instrument.body.shape.semi_axes;
    Strike strike;
    strike.instrument = number;
    strike.zone = zone;
    const double radius = 0.5 * (there.min_radius + std::min(1.0, there.max_radius));
    strike.point_body = {there.min_radius > 0 ? radius * half.x() : 0, half.y(), 0};
    return strike;
}

std::size_t sample_of(const AuditionRow& row, std::size_t speed) {
    return static_cast<std::size_t>(
        std::lround((row.onset_s + static_cast<double>(speed) * kAuditionSpacingS) * audio::kSampleRate));
}

/// Both sides of a stroke alone, for `seconds`.
std::vector<float> heard_alone(const Instrument& instrument, Strike strike, const audio::Mix& mix,
                               double seconds) {
    audio::Performance performance(orchestra_file(), {instrument.voice}, mix);
    strike.id = 1;
    audio::Note note = note_of(strike, instrument);
    note.voice = 0;
    performance.schedule(note);
    std::vector<float> sound =
        performance.finish(static_cast<std::int64_t>(std::lround(seconds * audio::kSampleRate)), 0);
    sound.resize(2 * static_cast<std::size_t>(std::lround(seconds * audio::kSampleRate)));
    return sound;
}

void fade_out(std::vector<float>& stereo) {
    const auto length = static_cast<std::size_t>(kCutFadeS * audio::kSampleRate);
    for (std::size_t i = 0; i < length; ++i)
        for (const std::size_t side : {1, 2})
            stereo[stereo.size() - 2 * i - side] *= static_cast<float>(i) / static_cast<float>(length);
}

}  // namespace

Audition audition(const Kit& kit, const std::string& only, std::span<const double> speeds_mps) {
    std::vector<std::string> names;
    for (const Instrument& instrument : kit.instruments) names.push_back(instrument.name);
    if (!only.empty() && std::ranges::find(names, only) == names.end())
        throw BadInput(fmt::format("error: found --instrument {}, expected one of {}{}", one_line(only),
                                   fmt::join(names, ", "), nearest_hint(only, names)));
    Audition heard{{speeds_mps.begin(), speeds_mps.end()}, {}, {}};
    heard.sound.resize(2 * static_cast<std::size_t>(kFirstS * audio::kSampleRate));
    double at_s = kFirstS;
    for (std::uint32_t i = 0; i < kit.instruments.size(); ++i) {
        if (!only.empty() && names[i] != only) continue;
        for (int zone = 0; zone < std::ssize(kit.instruments[i].zones); ++zone) {
            heard.rows.push_back({i, zone, at_s});
            for (const double speed_mps : speeds_mps) {
                Strike strike = stroke_at(kit.instruments[i], i, zone);
                strike.speed_mps = speed_mps;
                std::vector<float> stroke =
                    heard_alone(kit.instruments[i], strike, kit.mix, kAuditionSpacingS);
                fade_out(stroke);
                heard.sound.insert(heard.sound.end(), stroke.begin(), stroke.end());
                at_s += kAuditionSpacingS;
            }
        }
    }
    return heard;
}

void check_own_orchestras(const Kit& kit) {
    std::set<fs::path> compiled;
    for (std::uint32_t i = 0; i < kit.instruments.size(); ++i) {
        const Instrument& instrument = kit.instruments[i];
        const fs::path& own = instrument.voice.own_orchestra;
        if (own.empty()) continue;
        if (compiled.insert(own).second) audio::check_own_orchestra(orchestra_file(), own);
        Strike strike = stroke_at(instrument, i, 0);
        strike.speed_mps = 3;
        try {
            (void)heard_alone(instrument, strike, {}, kLevelS);
        } catch (const std::runtime_error& wrong) {
            throw BadInput(
                fmt::format("{}:1:1: error: found that instr {} fails when it is struck ({}), "
                            "expected one that sounds",
                            own.string(), instrument.voice.instrument, one_line(wrong.what())));
        }
    }
}

StrokeLevel level_of(const Audition& heard, const AuditionRow& row, std::size_t speed) {
    const std::size_t begin = 2 * sample_of(row, speed),
                      length = 2 * static_cast<std::size_t>(kAuditionSpacingS * audio::kSampleRate),
                      level = 2 * static_cast<std::size_t>(kLevelS * audio::kSampleRate);
    double peak = 0, squares = 0;
    for (std::size_t i = begin; i < std::min(begin + length, heard.sound.size()); ++i) {
        const double x = heard.sound[i];
        peak = std::max(peak, std::abs(x));
        if (i < begin + level) squares += x * x;
    }
    const auto decibel = [](double value) { return value > 1e-10 ? 20 * std::log10(value) : -200; };
    return {decibel(peak), decibel(std::sqrt(squares / static_cast<double>(level)))};
}

namespace {

/// The first 5 ms of a stroke: ms and the mean of both sides, a line a sample.
std::string beginning(const Audition& heard, std::size_t first) {
    std::string data;
    for (std::size_t i = 0; i <= kBeginningSamples; ++i) {
        const std::size_t at = 2 * (first + i);
        const float left = at < heard.sound.size() ? heard.sound[at] : 0,
                    right = at < heard.sound.size() ? heard.sound[at + 1] : 0;
        data += fmt::format("{:.4f} {}\n", 1e3 * static_cast<double>(i) / audio::kSampleRate,
                            0.5F * (left + right));
    }
    return data;
}

}  // namespace

std::string audition_sheet(const Kit& kit, const Audition& heard, const std::string& file) {
    constexpr std::size_t kWidth = 560, kHeight = 120, kMostPixels = 32000;  // cairo draws up to 32767
    constexpr int kColumns = 300;
    const std::size_t rows = heard.rows.size(), columns = heard.speeds_mps.size();
    std::string text = fmt::format(
        "reset\nset terminal pngcairo size {},{} noenhanced font 'sans-serif,8'\nset output {}\n"
        "set multiplot layout {},{} title {}\nunset key\nunset ytics\n",
        std::min(kWidth * columns, kMostPixels), std::min(kHeight * rows + 30, kMostPixels),
        gnuplot_string(file), rows, 2 * columns,
        gnuplot_string(
            fmt::format("{}: {} s and 5 ms from each onset [s, ms]", kit.name, kAuditionSpacingS)));
    for (const AuditionRow& row : heard.rows) {
        const Instrument& instrument = kit.instruments[row.instrument];
        double loudest = -80;
        for (std::size_t i = 0; i < columns; ++i)
            loudest = std::max(loudest, level_of(heard, row, i).peak_db);
        const double scale = std::pow(10, loudest / 20);
        for (std::size_t i = 0; i < columns; ++i) {
            const StrokeLevel level = level_of(heard, row, i);
            const double from = row.onset_s + static_cast<double>(i) * kAuditionSpacingS;
            std::string data = sound_envelope(heard.sound, -from, 0, kAuditionSpacingS, kColumns);
            if (data.empty()) data = "0 0 0\n";
            text += fmt::format(
                "set xrange [0:{}]\nset xtics 0.5\nset yrange [{}:{}]\nset title {}\n", kAuditionSpacingS,
                -scale, scale,
                gnuplot_string(fmt::format("{}, {}, {:g} m/s: {:.1f} dBFS, RMS {:.1f}", instrument.name,
                                           instrument.zones[static_cast<std::size_t>(row.zone)].name,
                                           heard.speeds_mps[i], level.peak_db, level.rms_db)));
            text += fmt::format("plot '-' using 1:2:(0):($3-$2) with vectors nohead lc rgb '#1f77b4'\n{}e\n",
                                data);
            text += fmt::format(
                "set xrange [0:5]\nset xtics 1\nset yrange [*:*]\nset title 'its first 5 ms'\n"
                "plot '-' with lines lc rgb '#1f77b4'\n{}e\n",
                beginning(heard, sample_of(row, i)));
        }
    }
    return text + "unset multiplot\nset output\n";
}

}  // namespace app
