#include "tracking/trace_rows.h"

#include <cmath>
#include <map>
#include <numbers>

#include "trace/orientation_forms.h"
#include "trace/text_cursor.h"
#include "trace/trace_keys.h"
#include "trace/trace_limits.h"
#include "tracking/rotation.h"

namespace tracking {
namespace {

constexpr double kLatestLive = 1e11;       // s
constexpr double kLargestIncrement = 100;  // rad
constexpr double kUnitTolerance =
    1e-14;  // of the squared norm: left as it is, so that written traces read back exactly

enum class Orientation { absent, quaternion, increment, euler };

constexpr const char* kHeaderHelp =
    "the header t,stick,px,py,pz with nothing or qw,qx,qy,qz or rx,ry,rz or ex,ey,ez after it";

/// One stick while it is read.
struct Stick {
    std::string name;
    std::size_t first_line = 0, first_offset = 0, last_line = 0;
    std::string first_text;
    std::size_t samples = 0;
    double t_s = 0;                                                   ///< of the last sample
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();  ///< likewise, y up
    Eigen::Quaterniond file_orientation =
        Eigen::Quaterniond::Identity();  ///< in the file's world, for increments
};

}  // namespace

struct TraceRows::Reading {
    Reading(std::string file, RowOrder row_order) : name(std::move(file)), order(row_order) {}

    std::optional<TraceRow> take(const Line& line) {
        if (headed) return read_row(line);
        const std::string_view text = trimmed(line.text());
        if (text.empty()) return std::nullopt;
        if (line.text().front() == '#') {
            keys.read(line);
            return std::nullopt;
        }
        line.require_text();
        read_header(line);
        keys.give_to(trace);
        headed = true;
        return std::nullopt;
    }

    void read_header(const Line& line) {
        std::string names;
        for (std::size_t offset = 0; offset != std::string_view::npos;)
            names += std::string(line.next_field(offset).text) + ",";
        if (names == "t,stick,px,py,pz,")
            orientation_ = Orientation::absent;
        else if (names == "t,stick,px,py,pz,qw,qx,qy,qz,")
            orientation_ = Orientation::quaternion;
        else if (names == "t,stick,px,py,pz,rx,ry,rz,")
            orientation_ = Orientation::increment;
        else if (names == "t,stick,px,py,pz,ex,ey,ez,")
            orientation_ = Orientation::euler;
        else
            line.fail(0, in_quotes(line.text()), kHeaderHelp,
                      "name the columns so, in this order, or bring the table in with `trace convert --map`");
        columns_ = orientation_ == Orientation::absent ? 5 : orientation_ == Orientation::quaternion ? 9 : 8;
    }

    void split(const Line& line) {
        std::size_t offset = 0;
        std::size_t count = 0;
        while (offset != std::string_view::npos && count < columns_)
            fields_[count++] = line.next_field(offset);
        if (count == columns_ && offset == std::string_view::npos) return;
        const std::string expected =
            std::to_string(columns_) +
            (assumed ? " fields: t,stick,px,py,pz,qw,qx,qy,qz" : " fields, as in the header");
        if (count == columns_)
            line.fail(offset - 1, "more than " + std::to_string(columns_) + " fields", expected,
                      "delete what is too much");
        line.fail(line.text().size(), std::to_string(count) + (count == 1 ? " field" : " fields"), expected,
                  "complete or delete the line");
    }

    TraceRow read_row(const Line& line) {
        line.require_text();
        split(line);
        const bool live = order == RowOrder::live;
        PoseSample sample;
        sample.t_s = line.number_in(fields_[0], "a time in seconds", live ? kLatestLive : kLatest,
                                    live ? "1e11" : "1e7");
        const std::size_t index = index_of(line);
        const bool known = index < sticks.size();
        if (known && !live) require_later(line, sticks[index], sample.t_s);
        sample.position = read_position(line);
        Stick first = known ? Stick{} : first_of(line);
        Stick& stick = known ? sticks[index] : first;
        read_orientation(line, stick, sample);
        stick.t_s = sample.t_s;
        stick.orientation = sample.orientation;
        stick.last_line = line.number();
        ++stick.samples;
        if (!known) add(std::move(first));
        latest_ = index;
        return {index, sticks[index].name, sample};
    }

    void add(Stick stick) {
        indices_.emplace(stick.name, sticks.size());
        sticks.push_back(std::move(stick));
    }

    /// The row's stick; sticks.size() for a new one.
    std::size_t index_of(const Line& line) const {
        const Field& field = fields_[1];
        if (latest_ < sticks.size() && sticks[latest_].name == field.text) return latest_;
        if (const auto known = indices_.find(field.text); known != indices_.end()) return known->second;
        if (field.text.empty() || field.text.size() > kLongestName ||
            field.text.find_first_of(" \t\"'") != std::string_view::npos)
            line.fail(field.offset, "stick name " + in_quotes(field.text),
                      "a word of at most 64 bytes without blanks or quotes", "rename the stick");
        if (order == RowOrder::live && sticks.size() == kMostLiveSticks)
            line.fail(field.offset, "one more stick " + in_quotes(field.text),
                      "at most " + std::to_string(kMostLiveSticks) + " sticks", "send fewer sticks");
        return sticks.size();
    }

    Stick first_of(const Line& line) const {
        Stick stick;
        stick.name = fields_[1].text;
        stick.first_line = line.number();
        stick.first_offset = fields_[1].offset;
        stick.first_text = line.text();
        return stick;
    }

    void require_later(const Line& line, const Stick& stick, double t) const {
        if (t > stick.t_s) return;
        line.fail(fields_[0].offset,
                  "sample time " + std::string(fields_[0].text) + " s of stick " + in_quotes(stick.name),
                  "later than that of line " + std::to_string(stick.last_line),
                  "sort the file or delete the repeated sample");
    }

    Eigen::Vector3d read_position(const Line& line) const {
        const double units = keys.units_per_metre();
        const char* limit = units == 1 ? "1000 m" : units == 100 ? "100000 cm" : "1000000 mm";
        Eigen::Vector3d p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = line.number_in(fields_[static_cast<std::size_t>(axis) + 2], "a coordinate",
                                     kFarthest * units, limit);
        p /= units;  // 0.001 is no double: dividing keeps whole mm exact
        if (keys.axes()) return *keys.axes() * p;
        return keys.z_up() ? from_z_up(p) : p;
    }

    /// True if the orientation fields are all empty; throws if only some are.
    bool orientation_left_out(const Line& line) const {
        std::size_t empty = 0;
        for (std::size_t i = 5; i < columns_; ++i) empty += fields_[i].text.empty() ? 1 : 0;
        if (empty == 0) return false;
        if (empty == columns_ - 5 && orientation_ != Orientation::increment) return true;
        for (std::size_t i = 5; i < columns_; ++i)
            if (fields_[i].text.empty())
                line.fail(fields_[i].offset, "an empty field",
                          orientation_ == Orientation::increment ? "an incremental rotation in every row"
                                                                 : "all orientation fields or none",
                          "fill in the row's orientation");
        return false;
    }

    void read_orientation(const Line& line, Stick& stick, PoseSample& sample) const {
        if (orientation_ == Orientation::absent) return;
        if (orientation_left_out(
                line)) {  // the newest known one, so that the tip stays where the stick last pointed
            sample.orientation = stick.orientation;
            return;
        }
        Eigen::Quaterniond q;
        if (orientation_ == Orientation::quaternion) {
            q = read_quaternion(line);
        } else {
            const Eigen::Vector3d v = read_angles(line);
            q = orientation_ == Orientation::euler ? from_euler(v * (std::numbers::pi / 180), "XYZ")
                                                   : stick.file_orientation * exponential(v);
        }
        if (std::abs(q.squaredNorm() - 1) > kUnitTolerance) q.normalize();
        stick.file_orientation = q;
        // Near two orthogonal ones rounding decides the sign: it is chosen as it will be when a y-up copy is read.
        if (keys.z_up()) q = from_z_up(q);
        if (keys.axes()) q = from_axes(*keys.axes(), q);
        if (q.dot(stick.orientation) < 0 && stick.samples > 0) q.coeffs() = -q.coeffs();
        sample.orientation = q;
        sample.has_orientation = true;
    }

    Eigen::Quaterniond read_quaternion(const Line& line) const {
        double c[4];
        for (std::size_t i = 0; i < 4; ++i)
            c[i] = line.number_in(fields_[5 + i], "a component of a unit quaternion", 1 + kNormTolerance,
                                  "1.01");
        const Eigen::Quaterniond q(c[0], c[1], c[2], c[3]);
        if (std::abs(q.norm() - 1) > kNormTolerance)
            line.fail(fields_[5].offset, "a quaternion of norm " + std::to_string(q.norm()),
                      "norm 1 within 1 %", "correct the quaternion, or leave its four fields empty");
        return q;
    }

    Eigen::Vector3d read_angles(const Line& line) const {
        const bool euler = orientation_ == Orientation::euler;
        Eigen::Vector3d v;
        for (int axis = 0; axis < 3; ++axis)
            v[axis] =
                line.number_in(fields_[static_cast<std::size_t>(axis) + 5],
                               euler ? "an Euler angle in degrees" : "an incremental rotation in rad",
                               euler ? kLargestAngle : kLargestIncrement, euler ? "1e6 degrees" : "100 rad");
        return v;
    }

    void require_complete() const {
        if (!headed)
            Line(name, lines + 1, "")
                .fail(0, "the end of the file", kHeaderHelp,
                      "check that this is a trace and that it is complete");
        if (sticks.empty())
            Line(name, lines + 1, "")
                .fail(0, "the end of the file", "at least two samples", "check that the trace is complete");
        for (const Stick& stick : sticks)
            if (stick.samples < 2)
                Line(name, stick.first_line, stick.first_text)
                    .fail(stick.first_offset, "one sample of stick " + in_quotes(stick.name),
                          "at least two samples a stick", "delete the line or complete the trace");
    }

    std::string name;
    RowOrder order;
    std::size_t lines = 0;
    bool headed = false, assumed = false;
    TraceKeys keys;
    Trace trace;  // what the keys say
    Orientation orientation_ = Orientation::absent;
    std::vector<Stick> sticks;

private:
    std::size_t columns_ = 5;
    Field fields_[9];
    std::map<std::string, std::size_t, std::less<>> indices_;
    std::size_t latest_ = 0;
};

TraceRows::TraceRows(const std::string& name, RowOrder order)
    : reading_(std::make_unique<Reading>(name, order)) {}
TraceRows::~TraceRows() = default;
TraceRows::TraceRows(TraceRows&& other) noexcept = default;
TraceRows& TraceRows::operator=(TraceRows&& other) noexcept = default;

std::optional<TraceRow> TraceRows::take(std::string_view line) {
    return reading_->take(Line(reading_->name, ++reading_->lines, line));
}

void TraceRows::assume_header() {
    (void)reading_->take(Line(reading_->name, 0, "t,stick,px,py,pz,qw,qx,qy,qz"));
    reading_->assumed = true;
}

bool TraceRows::headed() const noexcept {
    return reading_->headed;
}

bool TraceRows::oriented() const noexcept {
    return reading_->orientation_ != Orientation::absent;
}

const Trace& TraceRows::keys() const noexcept {
    return reading_->trace;
}

void TraceRows::require_complete() const {
    reading_->require_complete();
}

}  // namespace tracking
