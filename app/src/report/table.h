#pragma once
#include <concepts>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace app {

/// A value in a table: text, a number, an integer, yes or no, or none. NaN and an empty optional are none.
class Cell {
public:
    Cell() = default;
    Cell(bool value) : value_(value) {}
    Cell(std::integral auto value) : value_(static_cast<std::int64_t>(value)) {}
    Cell(double value) {
        if (value == value) value_ = value;
    }
    Cell(std::string value) : value_(std::move(value)) {}
    Cell(std::string_view value) : value_(std::string(value)) {}
    Cell(const char* value) : value_(std::string(value)) {}
    template <class Value>
    Cell(const std::optional<Value>& value) {
        if (value) *this = Cell(*value);
    }

    [[nodiscard]] bool none() const { return std::holds_alternative<std::monostate>(value_); }
    /// As in CSV: empty for none, numbers so that they read back to the same double, yes and no as 1 and 0.
    [[nodiscard]] std::string plain() const;
    /// For readers: `none` for none; numbers as `format` says, a format of fmt without braces (".2f").
    [[nodiscard]] std::string shown(std::string_view format, std::string_view none) const;
    [[nodiscard]] nlohmann::ordered_json json() const;

private:
    std::variant<std::monostate, bool, std::int64_t, double, std::string> value_;
};

/// A column with a format holds numbers and stands to the right; one without holds text.
struct Column {
    /// The column of CSV and key of JSON; "hits/f1" is the column f1, or the key f1 of an object hits. Readers
    /// see "f1", or "hits f1" if there is another f1, blanks for _, and behind it the unit, where the name
    /// does not end in it (rms_mm).
    std::string name;
    std::string format = {};  ///< of fmt without braces (".2f"); integers are shown in full
    std::string unit = {};
    bool in_csv = true;
};

/// A cell and its column: "NAME", "NAME:FORMAT" or "NAME:FORMAT:UNIT", e.g. "rms_mm:.2f", "error:.1f:%".
struct Figure {
    std::string column;
    Cell cell;
    bool in_csv = true;
};

using Cells = std::vector<Cell>;

/// Columns and rows, rendered in four ways.
struct Table {
    std::vector<Column> columns = {};
    std::vector<Cells> rows = {};  ///< of as many cells as there are columns

    /// Columns as a Figure has them.
    [[nodiscard]] static Table of(std::initializer_list<std::string_view> columns);

    void add(Cells row);
    /// A row of cells with their columns; those of the first row are the table's.
    void add_figures(const std::vector<Figure>& row);

    /// These columns, without the rows in which all but the first of them is none.
    [[nodiscard]] Table part(std::initializer_list<std::string_view> names) const;

    /// What readers see above each column.
    [[nodiscard]] std::vector<std::string> headings() const;
    /// Aligned for a terminal, "-" for none; empty without rows.
    [[nodiscard]] std::string text() const;
    /// Header and rows (RFC 4180, but lines end with \n).
    [[nodiscard]] std::string csv() const;
    /// For a page with report_page(), a dash for none; empty without rows.
    [[nodiscard]] std::string html() const;
    /// An array with an object per row. An object within that holds no value is null.
    [[nodiscard]] nlohmann::ordered_json json() const;
};

/// A text as a field of CSV: in quotes where it needs them (RFC 4180).
[[nodiscard]] std::string csv_field(std::string_view text);
/// A row of a CSV file: fields in quotes where they need them, \n at the end.
[[nodiscard]] std::string csv_line(std::span<const Cell> cells);
[[nodiscard]] std::string csv_line(std::initializer_list<Cell> cells);

}  // namespace app
