#include "report/plot_panel.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace app {

void PlotPanel::add(std::string data, std::string_view style) {
    if (data.empty()) return;
    fmt::format_to(std::back_inserter(clauses_), "{}'-' {}", clauses_.empty() ? "" : ", ", style);
    data_ += std::move(data) + "e\n";
}

std::string PlotPanel::text() const {
    return clauses_.empty() ? "plot NaN\n" : "plot " + clauses_ + "\n" + data_;
}

std::string plot_axes() {
    return fmt::format(
        "unset key\nset border 3 lt 1 lw 1 lc {0}\nset tics nomirror out scale 0.6 textcolor {0}\n"
        "set grid lt 1 lw 0.6 lc {1}\n",
        gnuplot_colour(colours::axis), gnuplot_colour(colours::grid));
}

double round_step(double span, int count) {
    const double rough = span / count, power = std::pow(10.0, std::floor(std::log10(rough)));
    for (const double factor : {1.0, 2.0, 5.0})
        if (factor * power >= rough * (1 - 1e-9)) return factor * power;
    return 10 * power;
}

std::string round_tics(std::string_view axis, double span, int count) {
    const double step = round_step(span, count);
    const int decimals = std::max(0, static_cast<int>(-std::floor(std::log10(step) + 1e-9)));
    return fmt::format("set {0}tics {1}\nset format {0} '%.{2}f'\n", axis, step, decimals);
}

void ThinnedMarks::add(double x, double y, std::string_view rest) {
    const auto pixel = [](double value, double low, double high, int size) {
        return static_cast<int>(std::floor(std::clamp((value - low) / (high - low), -1.0, 2.0) * size));
    };
    if (!(x >= area_.x_low && x <= area_.x_high)) return;
    const std::pair<int, int> place = {pixel(x, area_.x_low, area_.x_high, area_.width),
                                       pixel(y, area_.y_low, area_.y_high, area_.height)};
    if (taken_.insert(place).second)
        fmt::format_to(std::back_inserter(text_), "{:.4f} {:.4f} {}\n", x, y, rest);
}

std::string sound_envelope(std::span<const float> stereo, double t0_s, double from_s, double to_s,
                           int columns) {
    constexpr double kRate = 48000;
    const std::size_t frames = stereo.size() / 2;
    const double count = static_cast<double>(frames), column_s = (to_s - from_s) / columns;
    const auto sample_at = [&](double t_s) {
        return static_cast<std::size_t>(std::clamp(std::round((t_s - t0_s) * kRate), 0.0, count)) * 2;
    };
    std::string text;
    for (int i = 0; i < columns; ++i) {
        const std::size_t begin = sample_at(from_s + i * column_s),
                          end = sample_at(from_s + (i + 1) * column_s);
        if (begin == end) continue;
        const auto [low, high] = std::minmax_element(stereo.begin() + static_cast<std::ptrdiff_t>(begin),
                                                     stereo.begin() + static_cast<std::ptrdiff_t>(end));
        fmt::format_to(std::back_inserter(text), "{:.4f} {:.4f} {:.4f}\n", from_s + (i + 0.5) * column_s,
                       *low, *high);
    }
    return text;
}

}  // namespace app
