#pragma once
#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "trace/text_cursor.h"
#include "tracking/import.h"

namespace tracking {

enum class OrientationColumns { none, quaternion, euler, matrix };

/// A column, counted from 0, and what its numbers are multiplied by.
struct SignedColumn {
    std::size_t index = 0;
    double sign = 1;
};

/// The columns of one stick in a table.
struct StickColumns {
    std::string stick;  ///< empty: the table names none
    std::array<SignedColumn, 3> position{};
    OrientationColumns kind = OrientationColumns::none;
    std::vector<SignedColumn> orientation;  ///< w x y z | x y z | rows of the matrix
};

/// All columns that a map names, found in a table's header.
struct TableColumns {
    static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
    std::size_t time = kNone, frame = kNone, stick = kNone;
    std::vector<StickColumns> sticks;
    std::size_t count = 0;  ///< cells that a row needs at least
};

/// `names`: of the header's columns; empty where the table has no header. `header`: the line to name in
/// messages. Throws TraceError for columns that are not there, or there twice.
[[nodiscard]] TableColumns find_columns(const ColumnMap& map, const std::vector<std::string>& names,
                                        const Line& header);

/// Whether `text` is what `pattern` describes; '*' stands for anything.
[[nodiscard]] bool matches(std::string_view pattern, std::string_view text);

/// Throws std::invalid_argument for units, a rate or axes that cannot be.
void check_units(const ColumnMap& map);

/// A column of a map without the sign before it.
[[nodiscard]] std::string_view without_sign(std::string_view column);

/// The stick a role is of ("left" of "left.px"; empty if it says none), and the role without it.
[[nodiscard]] std::pair<std::string, std::string> split_role(const std::string& role);

/// The roles that belong together as a stick's orientation, in order.
[[nodiscard]] const std::vector<std::string>& orientation_roles(OrientationColumns kind);

}  // namespace tracking
