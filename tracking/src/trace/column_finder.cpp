#include "trace/column_finder.h"

#include <algorithm>
#include <charconv>
#include <set>
#include <stdexcept>

#include "trace/orientation_forms.h"
#include "trace/trace_limits.h"

namespace tracking {
namespace {

constexpr std::string_view kStick = "{stick}";

const std::vector<std::string>& position_roles() {
    static const std::vector<std::string> roles = {"px", "py", "pz"};
    return roles;
}

/// The name that stands for {stick}, so that the pattern matches; empty if none does.
std::string stick_in(std::string_view pattern, std::string_view text) {
    const std::size_t place = pattern.find(kStick);
    const std::string_view before = pattern.substr(0, place);
    if (!text.starts_with(before)) return {};
    text.remove_prefix(before.size());
    const std::string_view after = pattern.substr(place + kStick.size());
    for (std::size_t length = 1; length <= text.size() && text[length - 1] != '/'; ++length)
        if (matches(after, text.substr(length))) return std::string(text.substr(0, length));
    return {};
}

std::string with_stick(std::string pattern, const std::string& stick) {
    const std::size_t place = pattern.find(kStick);
    return place == std::string::npos ? pattern : pattern.replace(place, kStick.size(), stick);
}

/// The whole number after the first character of "#3" or "+3"; 0 if it is none.
std::size_t number_after_sign(std::string_view text) {
    std::size_t value = 0;
    const char* end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data() + 1, end, value);
    return error == std::errc() && stop == end && value <= 100000 ? value : 0;
}

class Finder {
public:
    Finder(const ColumnMap& map, const std::vector<std::string>& names, const Line& header)
        : map_(map), names_(names), header_(header) {}

    TableColumns find() {
        columns_.time = optional("t");
        columns_.frame = columns_.time == TableColumns::kNone ? optional("frame") : TableColumns::kNone;
        columns_.stick = optional("stick");
        std::set<std::string> prefixes;
        for (const auto& [role, column] : map_.columns)
            if (role.ends_with("px")) prefixes.insert(split_role(role).first);
        for (const std::string& prefix : prefixes) add_sticks(prefix);
        return std::move(columns_);
    }

private:
    std::size_t optional(const std::string& role) {
        const auto found = map_.columns.find(role);
        return found == map_.columns.end() ? TableColumns::kNone : column(found->second, 0);
    }

    /// A stick, or as many as {stick} finds.
    void add_sticks(const std::string& prefix) {
        const std::string pattern(without_sign(map_.columns.at(role_of(prefix, "px"))));
        if (pattern.find(kStick) == std::string::npos) {
            add_stick(prefix, prefix);
            return;
        }
        std::set<std::string> seen;
        for (const std::string& name : names_) {
            const std::string stick = stick_in(pattern, name);
            if (stick.empty() || !seen.insert(stick).second) continue;
            if (seen.size() > kMostSticks)
                header_.fail(0, "more than 64 columns that match " + in_quotes(pattern), "at most 64 sticks",
                             "make the map's px more specific");
            add_stick(prefix, stick);
        }
        if (seen.empty()) not_found(pattern);
    }

    static std::string role_of(const std::string& prefix, const std::string& role) {
        return prefix.empty() ? role : prefix + "." + role;
    }

    void add_stick(const std::string& prefix, const std::string& stick) {
        StickColumns found;
        found.stick = stick;
        std::size_t base = 0;
        const auto at = [&](const std::string& role) {
            const std::string& wanted = map_.columns.at(role_of(prefix, role));
            return SignedColumn{column(with_stick(std::string(without_sign(wanted)), stick), base),
                                wanted.starts_with('-') ? -1.0 : 1.0};
        };
        for (std::size_t i = 0; i < 3; ++i) {
            found.position[i] = at(position_roles()[i]);
            if (i == 0) base = found.position[0].index;
        }
        for (const OrientationColumns kind :
             {OrientationColumns::quaternion, OrientationColumns::euler, OrientationColumns::matrix}) {
            if (!map_.columns.contains(role_of(prefix, orientation_roles(kind).front()))) continue;
            found.kind = kind;
            for (const std::string& role : orientation_roles(kind)) found.orientation.push_back(at(role));
        }
        columns_.sticks.push_back(std::move(found));
    }

    std::size_t column(const std::string& wanted, std::size_t base) {
        std::size_t index = 0;
        if (wanted.starts_with('#')) {
            index = number_after_sign(wanted) - 1;
        } else if (wanted.starts_with('+')) {
            index = base + number_after_sign(wanted);
        } else {
            index = named(wanted);
        }
        if (!names_.empty() && index >= names_.size())
            header_.fail(0, std::to_string(names_.size()) + " columns",
                         "column " + std::to_string(index + 1) + ", which the map names " + in_quotes(wanted),
                         "correct the map");
        columns_.count = std::max(columns_.count, index + 1);
        return index;
    }

    std::size_t named(const std::string& pattern) {
        std::size_t found = TableColumns::kNone;
        for (std::size_t i = 0; i < names_.size(); ++i) {
            if (!matches(pattern, names_[i])) continue;
            if (found != TableColumns::kNone)
                header_.fail(0, "two columns " + in_quotes(pattern), "one",
                             "name the column by its number in the map: #" + std::to_string(found + 1) +
                                 " or #" + std::to_string(i + 1));
            found = i;
        }
        if (found == TableColumns::kNone) not_found(pattern);
        return found;
    }

    [[noreturn]] void not_found(const std::string& pattern) const {
        std::string known;
        for (std::size_t i = 0; i < names_.size() && i < 12; ++i)
            if (!names_[i].empty()) known += (known.empty() ? "" : ", ") + in_quotes(names_[i]);
        const bool unsplit = names_.size() == 1 && names_[0].find_first_of(";\t,") != std::string::npos;
        header_.fail(0, "no column " + in_quotes(pattern), "one of " + known,
                     unsplit ? "say what stands between the columns (--separator)" : "correct the map");
    }

    const ColumnMap& map_;
    const std::vector<std::string>& names_;
    const Line& header_;
    TableColumns columns_;
};

[[noreturn]] void refuse(const std::string& found, const std::string& expected) {
    throw std::invalid_argument("map: error: found " + found + ", expected " + expected);
}

/// Each stick's roles: three of position, and all or none of each kind of orientation, one kind at most.
void check_stick(const std::set<std::string>& roles, const std::string& stick, bool euler) {
    const std::string of = stick.empty() ? "" : " for stick " + in_quotes(stick);
    for (const std::string& role : position_roles())
        if (!roles.contains(role)) refuse("no column for " + role + of, "px, py and pz");
    int kinds = 0;
    for (const OrientationColumns kind :
         {OrientationColumns::quaternion, OrientationColumns::euler, OrientationColumns::matrix}) {
        const std::vector<std::string>& all = orientation_roles(kind);
        const auto given = std::count_if(all.begin(), all.end(),
                                         [&](const std::string& role) { return roles.contains(role); });
        if (given != 0 && given != static_cast<std::ptrdiff_t>(all.size()))
            refuse("only some of " + all.front() + " to " + all.back() + of, "all of them or none");
        kinds += given > 0;
        if (kind == OrientationColumns::euler && given > 0 && !euler)
            refuse("ex, ey, ez without an order" + of, "euler, such as XYZ");
    }
    if (kinds > 1) refuse("two kinds of orientation" + of, "one");
}

/// Each stick's markers: the first, then the second, then the third.
void check_markers(const std::map<std::string, std::string>& columns) {
    std::map<std::string, std::set<std::string>> sticks;
    for (const auto& [role, label] : columns) {
        const auto [stick, bare] = split_role(role);
        if (bare != "marker" && bare != "marker2" && bare != "marker3")
            refuse("role " + in_quotes(role) + " among markers", "marker, marker2 or marker3 of a stick");
        if (label.empty()) refuse("no label for " + in_quotes(role), "that of a point");
        sticks[stick].insert(bare);
    }
    for (const auto& [stick, roles] : sticks)
        if (!roles.contains("marker") || (roles.contains("marker3") && !roles.contains("marker2")))
            refuse("markers of stick " + in_quotes(stick) + " without the ones before",
                   "marker, then marker2, then marker3");
}

bool known_role(const std::string& role) {
    for (const OrientationColumns kind :
         {OrientationColumns::quaternion, OrientationColumns::euler, OrientationColumns::matrix})
        if (std::count(orientation_roles(kind).begin(), orientation_roles(kind).end(), role) > 0) return true;
    return std::count(position_roles().begin(), position_roles().end(), role) > 0;
}

}  // namespace

bool matches(std::string_view pattern, std::string_view text) {
    const std::size_t star = pattern.find('*');
    if (star == std::string_view::npos) return pattern == text;
    if (!text.starts_with(pattern.substr(0, star))) return false;
    text.remove_prefix(star);
    pattern.remove_prefix(star + 1);
    for (std::size_t next = pattern.find('*'); next != std::string_view::npos; next = pattern.find('*')) {
        const std::size_t place =
            text.find(pattern.substr(0, next));  // the first place leaves most for the rest
        if (place == std::string_view::npos) return false;
        text.remove_prefix(place + next);
        pattern.remove_prefix(next + 1);
    }
    return text.ends_with(pattern);
}

std::string_view without_sign(std::string_view column) {
    if (column.starts_with('-')) column.remove_prefix(1);
    return column;
}

std::pair<std::string, std::string> split_role(const std::string& role) {
    const std::size_t dot = role.rfind('.');
    if (dot == std::string::npos) return {"", role};
    return {role.substr(0, dot), role.substr(dot + 1)};
}

const std::vector<std::string>& orientation_roles(OrientationColumns kind) {
    static const std::vector<std::string> none,
        quaternion = {"qw", "qx", "qy", "qz"}, euler = {"ex", "ey", "ez"},
        matrix = {"m00", "m01", "m02", "m10", "m11", "m12", "m20", "m21", "m22"};
    switch (kind) {
        case OrientationColumns::quaternion:
            return quaternion;
        case OrientationColumns::euler:
            return euler;
        case OrientationColumns::matrix:
            return matrix;
        case OrientationColumns::none:
            break;
    }
    return none;
}

TableColumns find_columns(const ColumnMap& map, const std::vector<std::string>& names, const Line& header) {
    return Finder(map, names, header).find();
}

void check_units(const ColumnMap& map) {
    if (!(map.metres_per_unit.value_or(1) > 0) || !(map.seconds_per_unit > 0) ||
        !(map.rate_hz >= 0 && map.rate_hz <= 1e5))
        refuse("a unit or rate out of range", "positive units, a rate up to 100000 Hz");
    if (!map.frame.empty() && !axes_of(map.frame))
        refuse("frame " + in_quotes(map.frame),
               "unity, unreal, or where x, y and z point: a letter each of R or L, U or D, F or B");
    if (!map.frame.empty() && map.z_up) refuse("up z and a frame", "one of them");
}

bool ColumnMap::of_markers() const {
    return std::any_of(columns.begin(), columns.end(), [](const auto& column) {
        return split_role(column.first).second.starts_with("marker");
    });
}

void ColumnMap::check() const {
    if (std::string_view(",;\t ").find(separator) == std::string_view::npos)
        refuse("an unknown separator", "comma, semicolon, tab or space");
    if (decimal_comma && separator == ',') refuse("decimal commas between commas", "another separator");
    std::string sorted = euler;
    std::sort(sorted.begin(), sorted.end());
    if (!euler.empty() && sorted != "XYZ")
        refuse("euler " + in_quotes(euler), "an order of X, Y, Z such as XYZ");
    check_units(*this);
    if (of_markers()) return check_markers(columns);
    std::map<std::string, std::set<std::string>> sticks;
    for (const auto& [role, column] : columns) {
        const std::string_view bare_column = without_sign(column);
        if (bare_column.empty()) refuse("no column for " + in_quotes(role), "its name, #N or +N");
        if ((bare_column[0] == '#' || bare_column[0] == '+') && number_after_sign(bare_column) == 0)
            refuse("column " + in_quotes(column), "#N or +N with N from 1 to 100000");
        if (role == "t" || role == "frame" || role == "stick") {
            if (column[0] == '+' || column[0] == '-')
                refuse(in_quotes(column) + " for " + role, "a name or #N");
            continue;
        }
        const auto [stick, bare] = split_role(role);
        if (!known_role(bare))
            refuse("role " + in_quotes(role),
                   "t, frame, stick, px py pz, qw qx qy qz, ex ey ez or m00 .. m22");
        if (bare == "px" && bare_column[0] == '+') refuse("'+' for px", "a name or #N");
        sticks[stick].insert(bare);
    }
    if (sticks.empty()) refuse("no columns of positions", "px=..., py=..., pz=...");
    for (const auto& [stick, roles] : sticks) check_stick(roles, stick, !euler.empty());
    if (columns.contains("stick") && sticks.size() > 1)
        refuse("a stick column and several sticks", "one of them");
}

}  // namespace tracking
