#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "report/gnuplot.h"
#include "report/html.h"

namespace app {

/// A line of a plot, for its legend.
struct PlotLine {
    std::string name;
    ReportColour colour;
    bool dashed = false;
};

/// The n-th line's look: nine colours, then the same ones dashed.
[[nodiscard]] PlotLine line_of(std::size_t n, const std::string& name);
/// As gnuplot's "with lines ...".
[[nodiscard]] std::string style_of(const PlotLine& line, double width);

struct PlotWithLegend {
    PlotScript script;
    std::vector<PlotLine> legend;
};

/// The plots of a page: declared in the order of the page, drawn at once, placed by number.
class PlotGallery {
public:
    std::size_t add(PlotWithLegend plot, std::string label);
    void draw(const std::filesystem::path& scratch);
    /// What all elements refer to; once a page.
    [[nodiscard]] std::string symbols() const { return svg_symbols(drawn_.front()); }
    [[nodiscard]] std::string element(std::size_t number) const;
    [[nodiscard]] std::string pair(const std::vector<std::size_t>& numbers) const;

private:
    std::vector<PlotWithLegend> plots_;
    std::vector<std::string> labels_, drawn_;
};

}  // namespace app
