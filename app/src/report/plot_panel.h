#pragma once
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "report/html.h"

namespace app {

/// One panel of a gnuplot script: series with their data inline, drawn in the order they were added.
class PlotPanel {
public:
    /// `data`: lines of numbers; empty data is left out. `style`: e.g. "with lines lc rgb '#ff0000'".
    void add(std::string data, std::string_view style);
    /// The plot command; axes without data where nothing was added.
    [[nodiscard]] std::string text() const;

private:
    std::string clauses_, data_;
};

/// Axes and grid as all plots have them, no key.
[[nodiscard]] std::string plot_axes();

/// Tics every `step`, a round number of which about `count` fit into `span`, with as many decimals as they
/// need.
[[nodiscard]] std::string round_tics(std::string_view axis, double span, int count);
[[nodiscard]] double round_step(double span, int count);

/// The range that a panel shows and its size in SVG units.
struct PlotArea {
    double x_low = 0, x_high = 1, y_low = 0, y_high = 1;
    int width = 1, height = 1;
};

/// Marks of one kind, as lines of numbers: those outside of the range in x and those within a pixel of an
/// earlier one are left out, so that the number of marks is bounded however long the recording.
class ThinnedMarks {
public:
    explicit ThinnedMarks(const PlotArea& area) : area_(area) {}
    /// A mark at (x, y), written as the line "x y `rest`".
    void add(double x, double y, std::string_view rest = {});
    [[nodiscard]] const std::string& text() const { return text_; }

private:
    PlotArea area_;
    std::set<std::pair<int, int>> taken_;
    std::string text_;
};

/// Lowest and highest sample of the columns of a stretch of interleaved stereo sound, as lines "x low high";
/// x runs over [from_s, to_s] with the sound's first sample at t0_s. Columns outside of the sound are left
/// out.
[[nodiscard]] std::string sound_envelope(std::span<const float> stereo, double t0_s, double from_s,
                                         double to_s, int columns);

}  // namespace app
