#include "trace/table_lines.h"

#include <algorithm>

#include "trace/column_finder.h"

namespace tracking {
namespace {

constexpr std::size_t kLongestCell = 256;  // bytes of a header's cell that count
constexpr std::size_t kMostHeaderLines = 200;

Field unquoted(std::string_view whole, std::size_t from, std::size_t to) {
    while (from < to && is_blank(whole[from])) ++from;
    while (to > from && is_blank(whole[to - 1])) --to;
    if (to - from >= 2 && whole[from] == '"' && whole[to - 1] == '"') ++from, --to;
    return {whole.substr(from, to - from), from};
}

void split_at_blanks(std::string_view text, std::vector<Field>& cells) {
    for (std::size_t at = 0; at < text.size();) {
        if (is_blank(text[at])) {
            ++at;
            continue;
        }
        const std::size_t end = std::min(text.find_first_of(" \t", at), text.size());
        cells.push_back({text.substr(at, end - at), at});
        at = end;
    }
}

/// The end of the cell that begins at `at`: the next separator that is not within quotes.
std::size_t cell_end(std::string_view text, std::size_t at, char separator) {
    const std::size_t first = text.find_first_not_of(" \t", at);
    if (first != std::string_view::npos && text[first] == '"') {
        const std::size_t closing = text.find('"', first + 1);
        if (closing != std::string_view::npos) return std::min(text.find(separator, closing), text.size());
    }
    return std::min(text.find(separator, at), text.size());
}

/// The value after the cell that reads `key`; empty if there is none.
Field value_after(const std::vector<Field>& cells, const std::string& key) {
    for (std::size_t i = 0; !key.empty() && i + 1 < cells.size(); ++i)
        if (cells[i].text == key) return cells[i + 1];
    return {};
}

class Head {
public:
    Head(LineReader& lines, const ColumnMap& map, const std::string& name)
        : lines_(lines), map_(map), name_(name), head_{{}, Line(name, 1, ""), {}, {}} {}

    TableHead read() {
        if (map_.header.empty() && all_by_number()) return std::move(head_);
        while (!lines_.at_end() && lines_.lines_read() < kMostHeaderLines) {
            const Line line = lines_.next();
            const std::string_view text = trimmed(line.text());
            if (text.empty() || (map_.comment != 0 && text.front() == map_.comment)) continue;
            cells_.clear();
            split_cells(line, map_.separator, cells_);
            const bool last = map_.header.empty() || (!cells_.empty() && cells_[0].text == map_.header);
            if (last || begun_ || begins()) join(line);
            if (!begun_) read_values(line);
            if (!last) continue;
            head_.header = line;
            return std::move(head_);
        }
        Line(name_, lines_.lines_read() + 1, "")
            .fail(0, "no header",
                  map_.header.empty() ? std::string("one")
                                      : "a line that begins with " + in_quotes(map_.header),
                  "check that this is the kind of file that the map is for");
    }

private:
    [[nodiscard]] bool all_by_number() const {
        return std::all_of(map_.columns.begin(), map_.columns.end(), [](const auto& column) {
            const std::string_view bare = without_sign(column.second);
            return bare.starts_with('#') || bare.starts_with('+');
        });
    }

    [[nodiscard]] bool begins() const {
        if (map_.header_from.empty()) return false;
        for (std::size_t i = 0; i < cells_.size() && i < 2; ++i)
            if (cells_[i].text == map_.header_from) return true;
        return false;
    }

    void join(const Line& line) {
        line.require_text();
        begun_ = true;
        head_.names.resize(std::max(head_.names.size(), cells_.size()));
        for (std::size_t i = 0; i < cells_.size(); ++i) {
            std::string& name = head_.names[i];
            if (cells_[i].text.empty() || name.size() > kLongestCell) continue;
            if (!name.empty()) name += '/';
            name.append(cells_[i].text.substr(0, kLongestCell));
        }
    }

    void read_values(const Line& line) {
        const Field units = value_after(cells_, map_.units_from);
        if (!units.text.empty()) head_.metres_per_unit = metres_per(line, units);
        const Field rate = value_after(cells_, map_.rate_from);
        if (!rate.text.empty()) head_.rate_hz = line.number_in(rate, "a rate in Hz", 1e5, "100000");
    }

    static double metres_per(const Line& line, const Field& units) {
        if (units.text == "Meters" || units.text == "m") return 1;
        if (units.text == "Centimeters" || units.text == "cm") return 1e-2;
        if (units.text == "Millimeters" || units.text == "mm") return 1e-3;
        line.fail(units.offset, "units " + in_quotes(units.text), "Meters, Centimeters or Millimeters",
                  "export in one of these");
    }

    LineReader& lines_;
    const ColumnMap& map_;
    const std::string& name_;
    TableHead head_;
    std::vector<Field> cells_;
    bool begun_ = false;
};

}  // namespace

void split_cells(const Line& line, char separator, std::vector<Field>& cells) {
    const std::string_view text = line.text();
    if (separator == ' ') return split_at_blanks(text, cells);
    for (std::size_t at = 0;;) {
        const std::size_t end = cell_end(text, at, separator);
        cells.push_back(unquoted(text, at, end));
        if (end >= text.size()) return;
        at = end + 1;
    }
}

TableHead read_head(LineReader& lines, const ColumnMap& map, const std::string& name) {
    return Head(lines, map, name).read();
}

}  // namespace tracking
