#pragma once
#include <filesystem>
#include <functional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "files/output_folder.h"
#include "report/html.h"

namespace app {

/// A line of a plot, for its legend.
struct PlotLine {
    std::string name;
    ReportColour colour;
    bool dashed = false;
};

/// The commands of one picture, data inline.
struct PlotScript {
    int width = 640, height = 240;  ///< SVG units
    std::string commands;
    std::vector<PlotLine> legend = {};
    std::string keyed = {};  ///< the commands with the legend as a key, for a file of its own
};

/// Throws std::runtime_error where gnuplot cannot be started: before a run that ends with plots.
void require_gnuplot();

/// Commands of gnuplot and the picture that they make: an SVG or a PNG file.
struct PlotFile {
    std::filesystem::path file;
    std::string commands;
};

/// Draws with gnuplot. Plots adorn results and are none: one that cannot be drawn does not keep the others from
/// being drawn, has no file, and failure() says why.
class Plotter {
public:
    /// Files lie in `scratch`, an existing folder.
    explicit Plotter(std::filesystem::path scratch) : scratch_(std::move(scratch)) {}

    /// An SVG document per script; empty where it could not be drawn.
    [[nodiscard]] std::vector<std::string> draw(const std::vector<PlotScript>& scripts);
    /// Draws all with one gnuplot process in the C locale and without the user's start-up files; those that are not
    /// whole then, or all if the process failed, again each alone. What is left is whole.
    void draw_files(const std::vector<PlotFile>& pictures);
    /// What went wrong first; empty: nothing.
    [[nodiscard]] const std::string& failure() const { return failure_; }

private:
    std::filesystem::path scratch_;
    std::string failure_;
};

/// Writes a page with plots, which adorns a run: the text that `format` makes.
void write_page(OutputFolder& folder, std::string_view name,
                const std::function<std::string(Plotter&)>& format);

/// A name as a gnuplot string: quoted so that nothing in it is a command; control characters become spaces.
[[nodiscard]] std::string gnuplot_string(std::string_view text);
/// "rgb '#rrggbb'", for gnuplot.
[[nodiscard]] std::string gnuplot_colour(const ReportColour& colour);
[[nodiscard]] const ReportColour& stick_colour(std::size_t stick);

/// One panel of a gnuplot script: series with their data inline, drawn in the order they were added.
class PlotPanel {
public:
    /// `data`: lines of numbers; without any it is left out. One with a number that is not finite is a gap in a
    /// line. `style`: e.g. "with lines lc rgb '#ff0000'".
    void add(std::string_view data, std::string_view style);
    /// The plot command; axes without data where nothing was added. `key`: lines that stand in the key.
    [[nodiscard]] std::string text(const std::vector<PlotLine>& key = {}) const;

private:
    std::string clauses_, data_;
};

/// Axes and grid as all plots have them.
[[nodiscard]] std::string plot_axes();
/// An axis: what is along it, its range, and about how many round tics it has; 0: gnuplot's own.
struct PlotAxis {
    std::string label;
    double low, high;
    int tics = 0;
};
/// A plot of one panel. `more`: further commands.
[[nodiscard]] PlotScript plot_of(int width, int height, const PlotAxis& x, const PlotAxis& y,
                                 const PlotPanel& panel, std::string_view more = {},
                                 std::vector<PlotLine> legend = {});
/// Counts of values in bins of a width, as lines "middle count" for boxes; an empty bin at either end.
struct Histogram {
    std::string data;
    int highest = 1;
};
/// Values that are not finite are left out.
[[nodiscard]] Histogram histogram(std::span<const double> values, double bin);
/// gnuplot's "with boxes ..." of a histogram.
[[nodiscard]] std::string boxes_of(const ReportColour& colour);
/// Margins of a panel of a plot of `height`, from the top of the plot to the panel's top and bottom.
[[nodiscard]] std::string plot_margins(int top, int bottom, int height);

/// Tics every `step`, a round number of which about `count` fit into `span`, with as many decimals as they
/// need. A span that is not finite or not above 0 counts as 1.
[[nodiscard]] std::string round_tics(std::string_view axis, double span, int count);
[[nodiscard]] double round_step(double span, int count);

/// The range that a panel shows and its size in SVG units.
struct PlotArea {
    double x_low = 0, x_high = 1, y_low = 0, y_high = 1;
    int width = 1, height = 1;
};

/// Marks of one kind, as lines of numbers: those outside of the range in x and those within a pixel of an
/// earlier one are left out, so that the number of marks is bounded however long the recording; and those that are
/// not finite.
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

/// The n-th line's look: nine colours, then the same ones dashed.
[[nodiscard]] PlotLine line_of(std::size_t n, const std::string& name);
/// As gnuplot's "with lines ...".
[[nodiscard]] std::string style_of(const PlotLine& line, double width);

/// The plots of a page. Each stands as a mark in the page's text until drawn() draws all of them at once. In the
/// page they have no XML head, no titles that would pop up and no ids; their colours are CSS variables, their
/// width is that of their place, and a label says what they show for readers who do not see it.
class PlotGallery {
public:
    /// The plot alone: one or several stand in a frame.
    [[nodiscard]] std::string add(PlotScript plot, std::string label);
    [[nodiscard]] static std::string framed(const std::string& plots) {
        return "<div class=plot>\n" + plots + "</div>";
    }
    /// The plot in a frame with its label and legend above it; and several of these side by side.
    [[nodiscard]] std::string element(PlotScript plot, const std::string& label);
    [[nodiscard]] static std::string pair(const std::string& elements) {
        return "<div class=pair>" + elements + "</div>\n";
    }
    /// gnuplot's point shapes, which all plots refer to, as an invisible element; once a page.
    [[nodiscard]] static std::string symbols() { return "<!--symbols-->"; }
    /// The page with its plots in their places, and a note where one could not be drawn.
    [[nodiscard]] std::string drawn(std::string page, Plotter& plotter) const;

    /// Writes each plot with its label and its legend, on white: 01_LABEL.svg and 01_LABEL.png, of twice the size,
    /// and so on, into an existing folder.
    void write_files(const std::filesystem::path& folder, Plotter& plotter) const;

private:
    [[nodiscard]] std::string in_page(std::size_t number, std::string_view drawn) const;

    std::vector<PlotScript> plots_;
    std::vector<std::string> labels_;
};

}  // namespace app
