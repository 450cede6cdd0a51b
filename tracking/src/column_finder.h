#pragma once
#include <array>
#include <string>
#include <vector>

#include "text_cursor.h"
#include "tracking/import.h"

namespace tracking {

enum class OrientationColumns { none, quaternion, euler, matrix };

/// The columns of one stick in a table, counted from 0.
struct StickColumns {
    std::string stick;  ///< empty: the table names none
    std::array<std::size_t, 3> position{};
    OrientationColumns kind = OrientationColumns::none;
    std::vector<std::size_t> orientation;  ///< w x y z | x y z | rows of the matrix
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

/// The stick a role is of ("left" of "left.px"; empty if it says none), and the role without it.
[[nodiscard]] std::pair<std::string, std::string> split_role(const std::string& role);

/// The roles that belong together as a stick's orientation, in order.
[[nodiscard]] const std::vector<std::string>& orientation_roles(OrientationColumns kind);

}  // namespace tracking
