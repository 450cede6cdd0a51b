#include "report/plot_gallery.h"

#include <fmt/format.h>

#include <array>

namespace app {
namespace {

constexpr std::array<ReportColour, 9> kLineColours = {
    colours::sticks[0], colours::sticks[1], colours::sticks[2], colours::sticks[3], colours::released,
    colours::wrong,     colours::missed,    colours::wave,      colours::cancelled};

std::string legend_of(const std::vector<PlotLine>& lines) {
    std::string text = "<ul class=legend>\n";
    for (const PlotLine& line : lines)
        text += fmt::format(
            "<li><svg viewBox=\"0 0 22 12\" aria-hidden=\"true\"><path d=\"M1,6h20\" stroke=\"var(--{})\" "
            "stroke-width=\"2.5\"{}/></svg>{}</li>\n",
            line.colour.name, line.dashed ? " stroke-dasharray=\"5 3\"" : "", html(line.name));
    return text + "</ul>\n";
}

}  // namespace

PlotLine line_of(std::size_t n, const std::string& name) {
    return {name, kLineColours[n % kLineColours.size()], n / kLineColours.size() % 2 == 1};
}

std::string style_of(const PlotLine& line, double width) {
    return fmt::format("with lines lt 1 lw {}{} lc {}", width, line.dashed ? " dt '-'" : "",
                       gnuplot_colour(line.colour));
}

std::size_t PlotGallery::add(PlotWithLegend plot, std::string label) {
    plots_.push_back(std::move(plot));
    labels_.push_back(std::move(label));
    return plots_.size() - 1;
}

void PlotGallery::draw(const std::filesystem::path& scratch) {
    std::vector<PlotScript> scripts;
    for (const PlotWithLegend& plot : plots_) scripts.push_back(plot.script);
    drawn_ = draw_svg(scripts, scratch);
}

std::string PlotGallery::element(std::size_t number) const {
    const std::vector<PlotLine>& lines = plots_[number].legend;
    return fmt::format("<div><h3>{}</h3>\n{}<div class=plot>\n{}</div></div>\n", html(labels_[number]),
                       lines.empty() ? "" : legend_of(lines), inline_svg(drawn_[number], labels_[number]));
}

std::string PlotGallery::pair(const std::vector<std::size_t>& numbers) const {
    std::string text = "<div class=pair>";
    for (const std::size_t number : numbers) text += element(number);
    return text + "</div>\n";
}

}  // namespace app
