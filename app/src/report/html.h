#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace app {

/// A colour of the report: a CSS variable with a value for light and one for dark pages. Plots are drawn with
/// the light value.
struct ReportColour {
    std::string_view name;
    std::uint32_t light, dark;  ///< 0xRRGGBB
};

namespace colours {
inline constexpr ReportColour grid{"grid", 0xe4e8ee, 0x2f3945}, axis{"axis", 0x69737f, 0x97a3b0},
    released{"released", 0x2b9a48, 0x4fd070}, wrong{"wrong", 0xe03131, 0xff6b6b},
    missed{"missed", 0xb5179e, 0xf783e8}, cancelled{"cancelled", 0x5d6874, 0xa7b2be},
    contact{"contact", 0x10151c, 0xf2f5f8}, wave{"wave", 0x7c8fd6, 0x7186d8};
/// By stick, repeating after the fourth.
inline constexpr std::array<ReportColour, 4> sticks{{{"stick-1", 0x2468b4, 0x68aef5},
                                                     {"stick-2", 0xc07a12, 0xf0b04e},
                                                     {"stick-3", 0x6b46c1, 0xb197fc},
                                                     {"stick-4", 0x0f8a8a, 0x3fd0d0}}};
inline constexpr ReportColour all[] = {grid,    axis, released,  wrong,     missed,    cancelled,
                                       contact, wave, sticks[0], sticks[1], sticks[2], sticks[3]};
}  // namespace colours

/// Text for HTML: & < > " ' escaped, control characters replaced.
[[nodiscard]] std::string html(std::string_view text);

/// A page that needs nothing beside it; it follows the reader's choice of light or dark, and prints on white.
/// `title` is text, `body` HTML.
[[nodiscard]] std::string report_page(std::string_view title, std::string_view body);

/// What a page is about, and the facts that are not empty: name and value.
[[nodiscard]] std::string report_header(std::string_view title, std::string_view subtitle,
                                        const std::vector<std::pair<std::string, std::string>>& facts);

/// A figure of a page, in a colour of the report.
struct PageFigure {
    std::string value;
    std::string_view name, tone;
};
[[nodiscard]] std::string report_figures(const std::vector<PageFigure>& figures);

/// A legend: shapes (SVG, 22 x 12 units) and what they stand for.
[[nodiscard]] std::string report_legend(const std::vector<std::pair<std::string, std::string>>& entries);
/// A line as a shape.
[[nodiscard]] std::string line_shape(const ReportColour& colour, bool dashed = false);

}  // namespace app
