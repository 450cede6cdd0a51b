#pragma once
#include <cstdint>
#include <optional>
#include <string_view>

namespace tracking {

/// A date and time, or a time of day, as ISO 8601 writes it, in seconds since 1970 or midnight, UTC where the
/// zone is said.
struct IsoTime {
    enum class Form { time_of_day, local, zoned };
    std::int64_t whole_s = 0;
    double fraction_s = 0;  ///< in [0, 1)
    Form form = Form::local;
};

/// Reads YYYY-MM-DDThh:mm:ss[.f][zone], YYYYMMDDThhmmss[.f][zone] (a blank or t may stand for T), or
/// hh:mm:ss[.f]; the fraction after a point or a comma, the zone Z, +hh, +hhmm or +hh:mm (or -). Second 60 is
/// the next minute's first. None for anything else.
[[nodiscard]] std::optional<IsoTime> iso_time(std::string_view text);

/// From a to b [s]. Whole seconds are subtracted first, so that a fraction keeps its digits.
[[nodiscard]] inline double seconds_between(const IsoTime& a, const IsoTime& b) {
    return static_cast<double>(b.whole_s - a.whole_s) + (b.fraction_s - a.fraction_s);
}

}  // namespace tracking
