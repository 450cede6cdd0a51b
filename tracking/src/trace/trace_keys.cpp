#include "trace/trace_keys.h"

#include <algorithm>
#include <array>

#include "trace/orientation_forms.h"

namespace tracking {
namespace {

constexpr std::array<std::string_view, 7> kKeys = {"units",  "up",    "frame", "rate_hz",
                                                   "source", "tip_m", "shaft"};
constexpr double kFarthestTip = 3;  // m; a tip in mm by mistake lies beyond
constexpr double kHighestRate = 1e5;

/// True if one insertion, deletion or replacement turns a into b.
bool one_edit_apart(std::string_view a, std::string_view b) {
    if (a.size() > b.size()) std::swap(a, b);
    if (b.size() - a.size() > 1) return false;
    const auto differing = static_cast<std::size_t>(
        std::mismatch(a.begin(), a.end(), b.begin(), b.begin() + static_cast<std::ptrdiff_t>(a.size()))
            .first -
        a.begin());
    const std::size_t skip = a.size() == b.size() ? 1 : 0;
    return a.substr(std::min(differing + skip, a.size())) == b.substr(std::min(differing + 1, b.size()));
}

/// The known key that `key` looks like without being one; empty if none.
std::string_view near_miss(const std::string& key) {
    std::string lower = key;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    if (lower == "frames") return {};  // how many there are, in many a file
    for (const std::string_view known : kKeys) {
        const bool shortened = lower.size() >= 3 && known.starts_with(lower);
        if (lower == known || shortened || one_edit_apart(lower, known)) return known;
    }
    return {};
}

Field field_at(const Line& line, std::string_view part) {
    const std::string_view text = trimmed(part);
    return {text, static_cast<std::size_t>(text.data() - line.text().data())};
}

}  // namespace

void TraceKeys::read(const Line& line) {
    line.require_text();
    const std::string_view text = line.text();
    const std::size_t colon = text.find(':');
    if (colon == std::string_view::npos) return;
    const Field name = field_at(line, text.substr(1, colon - 1));
    const std::string key(name.text);
    if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
        const std::string_view meant = near_miss(key);
        if (!meant.empty())
            line.fail(name.offset, "key " + in_quotes(key), "key '" + std::string(meant) + "'",
                      "rename the key or drop its colon");
        return;
    }
    if (!seen_.insert(key).second)
        line.fail(name.offset, "key '" + key + "' a second time", "each key once",
                  "delete one of the two lines");
    set(line, key, field_at(line, text.substr(colon + 1)));
}

void TraceKeys::set(const Line& line, const std::string& key, const Field& value) {
    if (key == "units") {
        if (value.text != "m" && value.text != "cm" && value.text != "mm")
            line.fail(value.offset, "units " + in_quotes(value.text), "m, cm or mm",
                      "convert the positions and say which");
        units_per_metre_ = value.text == "mm" ? 1000 : value.text == "cm" ? 100 : 1;
    } else if (key == "up") {
        if (value.text != "y" && value.text != "z")
            line.fail(value.offset, "up " + in_quotes(value.text), "y or z",
                      "turn the coordinates and say which axis is up");
        z_up_ = value.text == "z";
        require_up_or_frame(line, value);
    } else if (key == "frame") {
        axes_ = axes_of(std::string(value.text));
        if (!axes_)
            line.fail(value.offset, "frame " + in_quotes(value.text),
                      "unity, unreal, or where x, y and z point: a letter each of R or L, U or D, F or B",
                      "name the axes, such as RUF for x right, y up, z forward");
        unreal_ = value.text == "unreal";
        require_up_or_frame(line, value);
    } else if (key == "rate_hz") {
        rate_hz_ = line.number_in(value, "a rate", kHighestRate, "100000 Hz");
        if (!(rate_hz_ > 0))
            line.fail(value.offset, "rate " + in_quotes(value.text), "a rate above 0 Hz",
                      "correct the rate or delete the line");
    } else if (key == "source") {
        source_ = value.text;
    } else if (key == "tip_m") {
        set_tip(line, value);
    } else {
        set_shaft(line, value);
    }
}

void TraceKeys::require_up_or_frame(const Line& line, const Field& value) const {
    if (z_up_ && axes_)
        line.fail(value.offset, "up z and a frame", "one of them", "delete one of the two lines");
}

void TraceKeys::set_tip(const Line& line, const Field& value) {
    Eigen::Vector3d tip;
    std::size_t offset = value.offset;
    for (int axis = 0; axis < 3; ++axis) {
        if (offset == std::string_view::npos)
            line.fail(line.text().size(), "the line's end", "three numbers x,y,z",
                      "write the tip as `# tip_m: 0,0,-0.35`");
        tip[axis] =
            line.number_in(line.next_field(offset), "a coordinate of the tip in metres", kFarthestTip, "3 m");
    }
    if (offset != std::string_view::npos)
        line.fail(offset - 1, "more than three numbers", "three numbers x,y,z",
                  "write the tip as `# tip_m: 0,0,-0.35`");
    tip_ = tip;
}

void TraceKeys::set_shaft(const Line& line, const Field& value) {
    const bool signed_axis = value.text.size() == 2 && (value.text[0] == '+' || value.text[0] == '-');
    const std::size_t axis =
        signed_axis ? std::string_view("xyz").find(value.text[1]) : std::string_view::npos;
    if (axis == std::string_view::npos)
        line.fail(value.offset, "shaft " + in_quotes(value.text), "one of +x, -x, +y, -y, +z, -z",
                  "name the body axis that points from hand to tip");
    shaft_ = (value.text[0] == '-' ? -1.0 : 1.0) * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis));
}

void TraceKeys::give_to(Trace& trace) const {
    trace.rate_hz = rate_hz_;
    trace.source = source_;
    trace.tip = tip_;
    trace.shaft = shaft_;
}

}  // namespace tracking
