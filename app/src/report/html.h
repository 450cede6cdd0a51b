#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

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
inline constexpr std::array<ReportColour, 8> marks{grid,   axis,      released, wrong,
                                                   missed, cancelled, contact,  wave};
}  // namespace colours

[[nodiscard]] const ReportColour& stick_colour(std::size_t stick);

/// "rgb '#rrggbb'", for gnuplot.
[[nodiscard]] std::string gnuplot_colour(const ReportColour& colour);

/// CSS declarations of all colours, "--grid:#e4e8ee;...", for a light or a dark page.
[[nodiscard]] std::string css_colours(bool dark);

/// A plot of gnuplot as an element of an HTML page: no XML head, no titles that would pop up, no ids, colours
/// by CSS variables, scaled to the width of its place. Its point shapes are those of svg_symbols(), once a
/// page. `label` says what it shows, for readers who do not see it.
[[nodiscard]] std::string inline_svg(std::string_view svg, std::string_view label);

/// The definitions of gnuplot's point shapes, taken from any plot, as an invisible element.
[[nodiscard]] std::string svg_symbols(std::string_view svg);

/// Text for HTML: & < > " ' escaped, control characters replaced.
[[nodiscard]] std::string html(std::string_view text);

}  // namespace app
