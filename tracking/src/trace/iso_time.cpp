#include "trace/iso_time.h"

#include <algorithm>
#include <charconv>
#include <chrono>

namespace tracking {
namespace {

/// Takes a text from its beginning.
class Taker {
public:
    explicit Taker(std::string_view text) : rest_(text) {}

    [[nodiscard]] bool done() const { return rest_.empty(); }
    [[nodiscard]] bool one_of(std::string_view characters) {
        if (rest_.empty() || characters.find(rest_.front()) == std::string_view::npos) return false;
        taken_ = rest_.front();
        rest_.remove_prefix(1);
        return true;
    }
    [[nodiscard]] char taken() const { return taken_; }
    /// The number of exactly `count` digits, at most `largest`; -1 if there is none.
    [[nodiscard]] int digits(std::size_t count, int largest) {
        int value = 0;
        if (rest_.size() < count) return -1;
        const auto [end, problem] = std::from_chars(rest_.data(), rest_.data() + count, value);
        if (problem != std::errc() || end != rest_.data() + count || rest_.front() == '-' || value > largest)
            return -1;
        rest_.remove_prefix(count);
        return value;
    }
    /// The digits that follow, as those of a fraction; negative if there is none.
    [[nodiscard]] double fraction() {
        double value = 0, unit = 1;
        std::size_t count = 0;
        for (; count < rest_.size() && rest_[count] >= '0' && rest_[count] <= '9'; ++count)
            if (count < 15) value = 10 * value + (rest_[count] - '0'), unit *= 10;
        rest_.remove_prefix(count);
        return count == 0 ? -1 : value / unit;
    }

private:
    std::string_view rest_;
    char taken_ = 0;
};

/// Days since 1970-01-01; none for a day that is not in the calendar.
std::optional<std::int64_t> day_in(Taker& text, bool& spelt) {
    const int year = text.digits(4, 9999);
    if (year < 0) return std::nullopt;
    spelt = text.one_of("-");
    const int month = text.digits(2, 12);
    if (month < 0 || (spelt && !text.one_of("-"))) return std::nullopt;
    const int day = text.digits(2, 31);
    const std::chrono::year_month_day date(std::chrono::year(year),
                                           std::chrono::month(static_cast<unsigned>(month)),
                                           std::chrono::day(static_cast<unsigned>(std::max(day, 0))));
    if (day < 0 || !date.ok()) return std::nullopt;
    return std::chrono::sys_days(date).time_since_epoch().count();
}

/// Adds hh:mm:ss[.f] (`spelt`: with its colons).
bool add_time(Taker& text, bool spelt, IsoTime& time) {
    const int hour = text.digits(2, 23);
    if (hour < 0 || (spelt && !text.one_of(":"))) return false;
    const int minute = text.digits(2, 59);
    if (minute < 0 || (spelt && !text.one_of(":"))) return false;
    const int second = text.digits(2, 60);
    if (second < 0) return false;
    time.whole_s += 3600 * hour + 60 * minute + second;
    if (!text.one_of(".,")) return true;
    time.fraction_s = text.fraction();
    return time.fraction_s >= 0;
}

bool add_zone(Taker& text, IsoTime& time) {
    if (text.done()) return true;
    time.form = IsoTime::Form::zoned;
    if (text.one_of("Zz")) return true;
    if (!text.one_of("+-")) return false;
    const int sign = text.taken() == '+' ? 1 : -1;
    const int hours = text.digits(2, 23);
    if (hours < 0) return false;
    const bool colon = text.one_of(":");
    const int minutes = colon || !text.done() ? text.digits(2, 59) : 0;
    if (minutes < 0) return false;
    time.whole_s -= sign * (3600 * hours + 60 * minutes);
    return true;
}

}  // namespace

std::optional<IsoTime> iso_time(std::string_view text) {
    IsoTime time;
    Taker rest(text);
    bool spelt = true;
    if (text.size() > 2 && text[2] == ':') {
        time.form = IsoTime::Form::time_of_day;
    } else {
        const std::optional<std::int64_t> day = day_in(rest, spelt);
        if (!day || !rest.one_of("Tt ")) return std::nullopt;
        time.whole_s = 86400 * *day;
    }
    if (!add_time(rest, spelt, time)) return std::nullopt;
    if (time.form != IsoTime::Form::time_of_day && !add_zone(rest, time)) return std::nullopt;
    if (!rest.done()) return std::nullopt;
    return time;
}

}  // namespace tracking
