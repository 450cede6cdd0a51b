#include "play/audition.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/bad_input.h"
#include "play/play_run.h"
#include "report/plot.h"

namespace app {
namespace {

constexpr double kFirstS = 0.1, kLevelS = 0.1;

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

}  // namespace

Audition audition(const Kit& kit, const std::string& only, std::span<const double> speeds_mps) {
    std::vector<std::string> names;
    for (const Instrument& instrument : kit.instruments) names.push_back(instrument.name);
    if (!only.empty() && std::ranges::find(names, only) == names.end())
        throw BadInput(fmt::format("error: found --instrument {}, expected one of {}{}", one_line(only),
                                   fmt::join(names, ", "), nearest_hint(only, names)));
    Audition heard{{speeds_mps.begin(), speeds_mps.end()}, {}, {}};
    audio::Performance performance(orchestra_file(), voices_of(kit), kit.mix);
    double at_s = kFirstS;
    std::uint64_t id = 0;
    for (std::uint32_t i = 0; i < kit.instruments.size(); ++i) {
        if (!only.empty() && names[i] != only) continue;
        for (int zone = 0; zone < std::ssize(kit.instruments[i].zones); ++zone) {
            const AuditionRow& row = heard.rows.emplace_back(AuditionRow{i, zone, at_s});
            Strike strike = stroke_at(kit.instruments[i], i, zone);
            for (std::size_t speed = 0; speed < speeds_mps.size(); ++speed) {
                strike.id = ++id;
                strike.speed_mps = speeds_mps[speed];
                strike.onset_sample = static_cast<std::int64_t>(sample_of(row, speed));
                performance.schedule(note_of(strike, kit.instruments[i]));
            }
            at_s += static_cast<double>(speeds_mps.size()) * kAuditionSpacingS;
        }
    }
    const auto length = static_cast<std::int64_t>(std::ceil(at_s * audio::kSampleRate));
    heard.sound = performance.finish(length, 10 * audio::kSampleRate);
    return heard;
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

std::string audition_sheet(const Kit& kit, const Audition& heard, const std::string& file) {
    constexpr int kWidth = 340, kHeight = 120, kColumns = 300;
    const std::size_t rows = heard.rows.size(), columns = heard.speeds_mps.size();
    std::string text = fmt::format(
        "reset\nset terminal pngcairo size {},{} noenhanced font 'sans-serif,8'\nset output {}\n"
        "set multiplot layout {},{} title {}\nunset key\nunset ytics\nset xtics 0.5\nset xrange [0:{}]\n",
        kWidth * columns, kHeight * rows + 30, gnuplot_string(file), rows, columns,
        gnuplot_string(fmt::format("{}: {} s from each onset", kit.name, kAuditionSpacingS)),
        kAuditionSpacingS);
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
                "set yrange [{}:{}]\nset title {}\n", -scale, scale,
                gnuplot_string(fmt::format("{}, {}, {:g} m/s: {:.1f} dBFS, RMS {:.1f}", instrument.name,
                                           instrument.zones[static_cast<std::size_t>(row.zone)].name,
                                           heard.speeds_mps[i], level.peak_db, level.rms_db)));
            text += fmt::format("plot '-' using 1:2:(0):($3-$2) with vectors nohead lc rgb '#1f77b4'\n{}e\n",
                                data);
        }
    }
    return text + "unset multiplot\nset output\n";
}

}  // namespace app
