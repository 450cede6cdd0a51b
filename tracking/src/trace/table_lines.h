#pragma once
#include <optional>
#include <string>
#include <vector>

#include "trace/text_cursor.h"
#include "tracking/import.h"

namespace tracking {

/// The cells of a line, blanks and one pair of double quotes around each left out.
void split_cells(const Line& line, char separator, std::vector<Field>& cells);

/// What stands above a table's rows.
struct TableHead {
    std::vector<std::string> names;  ///< of the columns, empty without a header
    Line header;                     ///< its last line (for a table without one, an empty first line)
    std::optional<double> metres_per_unit, rate_hz;  ///< if the map says where the file has them
};

/// Reads up to and including the header. Throws TraceError where there is none.
[[nodiscard]] TableHead read_head(LineReader& lines, const ColumnMap& map, const std::string& name);

}  // namespace tracking
