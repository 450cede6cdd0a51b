#include "report/html.h"

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

namespace app {
namespace {

struct Rgb {
    unsigned red, green, blue;
};

Rgb parts(std::uint32_t rgb) {
    return {(rgb >> 16) & 255U, (rgb >> 8) & 255U, rgb & 255U};
}

void replace_all(std::string& text, std::string_view from, std::string_view to) {
    std::string replaced;
    std::size_t done = 0;
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, done)) {
        replaced.append(text, done, at - done).append(to);
        done = at + from.size();
    }
    if (done > 0) text = replaced.append(text, done);
}

/// From the first `from` to the next `to` after it, both included.
std::string_view span_of(std::string_view text, std::string_view from, std::string_view to) {
    const std::size_t begin = text.find(from);
    const std::size_t end = begin == std::string_view::npos ? begin : text.find(to, begin + from.size());
    if (end == std::string_view::npos)
        throw std::runtime_error(
            fmt::format("error: found a plot without {}, expected one of gnuplot 5", from));
    return text.substr(begin, end + to.size() - begin);
}

/// gnuplot writes its colours as attributes: what it drew in one of ours follows the page, black is the
/// page's text.
void follow_page(std::string& svg) {
    const auto follow = [&](const ReportColour& colour) {
        const Rgb rgb = parts(colour.light);
        const std::string variable = fmt::format("var(--{})", colour.name);
        replace_all(svg, fmt::format("rgb({:3}, {:3}, {:3})", rgb.red, rgb.green, rgb.blue),
                    variable);                                                                   // lines
        replace_all(svg, fmt::format("rgb({},{},{})", rgb.red, rgb.green, rgb.blue), variable);  // text
    };
    for (const ReportColour& colour : colours::marks) follow(colour);
    for (const ReportColour& colour : colours::sticks) follow(colour);
    replace_all(svg, "\"black\"", "\"currentColor\"");
    replace_all(svg, "'black'", "'currentColor'");
}

/// Lines without the groups that hold nothing (gnuplot writes four of them a tick), titles and ids.
std::string without_ballast(std::string_view svg) {
    std::vector<std::string_view> lines;
    for (std::size_t at = 0; at < svg.size();) {
        const std::size_t end = std::min(svg.find('\n', at), svg.size());
        const std::string_view line = svg.substr(at, end - at);
        at = end + 1;
        if (line == "</g>" && !lines.empty() && lines.back().starts_with("<g fill=\"none\"") &&
            lines.back().ends_with(">")) {
            lines.pop_back();
        } else if (!line.empty()) {
            lines.push_back(line);
        }
    }
    std::string out;
    for (const std::string_view line : lines) {
        const bool named =
            line.starts_with("\t<g id=\"gnuplot_plot_") || line.starts_with("<g id=\"gnuplot_canvas\"");
        out += named ? "<g>" : line;
        out += '\n';
    }
    return out;
}

}  // namespace

const ReportColour& stick_colour(std::size_t stick) {
    return colours::sticks[stick % colours::sticks.size()];
}

std::string gnuplot_colour(const ReportColour& colour) {
    return fmt::format("rgb '#{:06x}'", colour.light);
}

std::string css_colours(bool dark) {
    std::string css;
    const auto declare = [&](const ReportColour& colour) {
        css += fmt::format("--{}:#{:06x};", colour.name, dark ? colour.dark : colour.light);
    };
    for (const ReportColour& colour : colours::marks) declare(colour);
    for (const ReportColour& colour : colours::sticks) declare(colour);
    return css;
}

std::string inline_svg(std::string_view svg, std::string_view label) {
    const std::string_view view_box = span_of(svg, "viewBox=\"", "\"");
    std::string drawn = without_ballast(span_of(svg, "</defs>", "</svg>").substr(7));
    follow_page(drawn);
    // The definitions, left out, stood inside the canvas's group.
    return fmt::format("<svg role=\"img\" aria-label=\"{}\" {}>\n<g>\n{}", html(label), view_box, drawn);
}

std::string svg_symbols(std::string_view svg) {
    const std::string_view definitions = span_of(svg, "<defs>", "</defs>");
    return fmt::format(
        "<svg width=\"0\" height=\"0\" style=\"position:absolute\" aria-hidden=\"true\">{}</svg>\n",
        definitions);
}

std::string html(std::string_view text) {
    std::string out;
    for (const char c : text) {
        switch (c) {
            case '&':
                out += "&amp;";
                break;
            case '<':
                out += "&lt;";
                break;
            case '>':
                out += "&gt;";
                break;
            case '"':
                out += "&quot;";
                break;
            case '\'':
                out += "&#39;";
                break;
            default:
                out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? ' ' : c;
        }
    }
    return out;
}

}  // namespace app
