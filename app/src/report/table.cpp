#include "report/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <nlohmann/json.hpp>

#include "report/html.h"

namespace app {
namespace {

constexpr std::size_t kLongText = 60;  // bytes; may wrap on a page

template <class... Functions>
struct Visitor : Functions... {
    using Functions::operator()...;
};
template <class... Functions>
Visitor(Functions...) -> Visitor<Functions...>;

/// Without the objects that JSON puts it into.
std::string last_part(const std::string& name) {
    return name.substr(name.rfind('/') + 1);
}

/// Characters of UTF-8.
std::size_t width_of(std::string_view text) {
    return static_cast<std::size_t>(std::count_if(
        text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xc0) != 0x80; }));
}

std::string aligned(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths,
                    const std::vector<Column>& columns) {
    std::string line;
    for (std::size_t i = 0; i < cells.size(); ++i) {
        const std::string space(widths[i] - width_of(cells[i]), ' ');
        if (i > 0) line += "  ";
        line += columns[i].format.empty() ? cells[i] + space : space + cells[i];
    }
    return line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
}

bool empty_object(const nlohmann::ordered_json& json) {
    return json.is_object() && std::ranges::all_of(json, [](const auto& value) { return value.is_null(); });
}

Column column_of(std::string_view text) {
    Column column;
    for (std::string* part : {&column.name, &column.format, &column.unit}) {
        const std::size_t end = std::min(text.find(':'), text.size());
        *part = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return column;
}

}  // namespace

std::string Cell::plain() const {
    return std::visit(Visitor{[](std::monostate) { return std::string(); },
                              [](bool value) { return std::string(value ? "1" : "0"); },
                              [](const auto& value) { return fmt::format("{}", value); }},
                      value_);
}

std::string Cell::shown(std::string_view format, std::string_view none) const {
    if (this->none()) return std::string(none);
    const auto* number = std::get_if<double>(&value_);
    return number == nullptr ? plain() : fmt::format(fmt::runtime(fmt::format("{{:{}}}", format)), *number);
}

nlohmann::ordered_json Cell::json() const {
    using Json = nlohmann::ordered_json;
    return std::visit(
        Visitor{[](std::monostate) { return Json(); }, [](const auto& value) { return Json(value); }},
        value_);
}

std::string csv_field(std::string_view text) {
    if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
    std::string quoted = "\"";
    for (const char c : text) quoted.append(c == '"' ? 2 : 1, c);
    return quoted + '"';
}

std::string csv_line(std::span<const Cell> cells) {
    std::string line;
    for (const Cell& cell : cells) line += csv_field(cell.plain()) + ',';
    line.back() = '\n';
    return line;
}

std::string csv_line(std::initializer_list<Cell> cells) {
    return csv_line(std::span(cells.begin(), cells.size()));
}

Table Table::of(std::initializer_list<std::string_view> columns) {
    Table table;
    for (const std::string_view column : columns) table.columns.push_back(column_of(column));
    return table;
}

void Table::add(Cells row) {
    assert(row.size() == columns.size() && "a row has a cell for every column");
    rows.push_back(std::move(row));
}

void Table::add_figures(const std::vector<Figure>& row) {
    Cells cells;
    for (const Figure& figure : row) {
        if (rows.empty()) {
            columns.push_back(column_of(figure.column));
            columns.back().in_csv = figure.in_csv;
        }
        cells.push_back(figure.cell);
    }
    add(std::move(cells));
}

Table Table::part(std::initializer_list<std::string_view> names) const {
    if (rows.empty()) return {};
    Table part;
    std::vector<std::size_t> chosen;
    for (const std::string_view name : names) {
        const auto column = std::ranges::find(columns, name, &Column::name);
        assert(column != columns.end() && "a part is of columns that there are");
        chosen.push_back(static_cast<std::size_t>(column - columns.begin()));
        part.columns.push_back(*column);
    }
    for (const auto& row : rows) {
        Cells cells;
        for (const std::size_t at : chosen) cells.push_back(row[at]);
        if (std::any_of(cells.begin() + 1, cells.end(), [](const Cell& cell) { return !cell.none(); }))
            part.add(std::move(cells));
    }
    return part;
}

std::vector<std::string> Table::headings() const {
    std::vector<std::string> headings;
    for (const Column& column : columns) {
        std::string name = last_part(column.name);
        const auto same = [&](const Column& other) { return last_part(other.name) == name; };
        if (std::ranges::count_if(columns, same) > 1) name = column.name;
        std::ranges::replace(name, '/', ' ');
        std::ranges::replace(name, '_', ' ');
        headings.push_back(column.unit.empty() ? name : name + " " + column.unit);
    }
    return headings;
}

std::string Table::text() const {
    if (rows.empty()) return {};
    std::vector<std::vector<std::string>> lines = {headings()};
    for (const auto& row : rows) {
        std::vector<std::string>& line = lines.emplace_back();
        for (std::size_t i = 0; i < row.size(); ++i) line.push_back(row[i].shown(columns[i].format, "-"));
    }
    std::vector<std::size_t> widths(columns.size());
    for (const auto& line : lines)
        for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], width_of(line[i]));
    std::string text;
    for (const auto& line : lines) text += aligned(line, widths, columns);
    return text;
}

std::string Table::csv() const {
    Cells line;
    const auto add_line = [&](std::string& text, const auto& cell_of) {
        line.clear();
        for (std::size_t i = 0; i < columns.size(); ++i)
            if (columns[i].in_csv) line.push_back(cell_of(i));
        text += csv_line(line);
    };
    std::string text;
    add_line(text, [&](std::size_t i) { return Cell(last_part(columns[i].name)); });
    for (const auto& row : rows) add_line(text, [&](std::size_t i) { return row[i]; });
    return text;
}

std::string Table::html() const {
    if (rows.empty()) return {};
    const auto kind = [&](std::size_t column) { return columns[column].format.empty() ? "" : " class=n"; };
    std::string text = "<div class=scroll><table class=wide><tr>";
    const std::vector<std::string> headings = this->headings();
    for (std::size_t i = 0; i < columns.size(); ++i)
        text += fmt::format("<th{}>{}", kind(i), app::html(headings[i]));
    for (const auto& row : rows) {
        text += "</tr>\n<tr>";
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::string cell = row[i].shown(columns[i].format, "\xe2\x80\x93");
            text +=
                fmt::format("<td{}>{}", cell.size() > kLongText ? " class=text" : kind(i), app::html(cell));
        }
    }
    return text + "</tr>\n</table></div>\n";
}

nlohmann::ordered_json Table::json() const {
    using Json = nlohmann::ordered_json;
    Json array = Json::array();
    for (const auto& row : rows) {
        Json object = Json::object();
        for (std::size_t i = 0; i < row.size(); ++i)
            object[Json::json_pointer("/" + columns[i].name)] = row[i].json();
        for (auto& value : object)
            if (empty_object(value)) value = Json();
        array.push_back(std::move(object));
    }
    return array;
}

}  // namespace app
