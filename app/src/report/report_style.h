#pragma once
#include <string>
#include <string_view>

namespace app {

/// The style sheet of report.html: follows the reader's choice of light or dark, prints on white.
[[nodiscard]] std::string report_style();
/// A page that needs nothing beside it. `title` is text, `body` HTML.
[[nodiscard]] std::string report_page(std::string_view title, std::string_view body);

/// An entry of a list of class `facts`.
[[nodiscard]] std::string report_fact(std::string_view name, std::string_view value);
/// A card of a section of class `figures`, in a colour of the report.
[[nodiscard]] std::string report_figure(std::string_view value, std::string_view name, std::string_view tone);

}  // namespace app
