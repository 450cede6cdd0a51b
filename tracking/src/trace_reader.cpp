#include <cmath>
#include <numbers>
#include <unordered_map>

#include "bsor_reader.h"
#include "orientation_forms.h"
#include "text_cursor.h"
#include "trace_keys.h"
#include "tracking/rotation.h"
#include "tracking/trace.h"

namespace tracking {
namespace {

constexpr double kLatest = 1e7;            // s
constexpr double kFarthest = 1000;         // m
constexpr double kLargestAngle = 1e6;      // degrees
constexpr double kLargestIncrement = 100;  // rad
constexpr double kNormTolerance = 0.01;
constexpr double kUnitTolerance =
    1e-14;  // of the squared norm: left as it is, so that written traces read back exactly
constexpr std::size_t kLongestName = 64;

enum class Orientation { absent, quaternion, increment, euler };

constexpr const char* kHeaderHelp =
    "the header t,stick,px,py,pz with nothing or qw,qx,qy,qz or rx,ry,rz or ex,ey,ez after it";

/// One stick while it is read.
struct Reading {
    StickTrace trace;
    std::size_t first_line = 0;
    std::size_t first_offset = 0;
    std::string_view first_text;
    std::size_t last_line = 0;
    Eigen::Quaterniond file_orientation =
        Eigen::Quaterniond::Identity();  ///< in the file's world, for increments
};

class Reader {
public:
    Reader(std::string_view text, const std::string& name) : name_(name), lines_(text, name) {
        trace_.file = name;
    }

    Trace read() {
        read_head();
        while (!lines_.at_end()) {
            const Line line = lines_.next();
            if (trimmed(line.text()).empty()) {
                if (lines_.only_blank_left()) break;
                line.fail(0, "an empty line", "a sample", "delete the line");
            }
            read_row(line);
        }
        return finish();
    }

private:
    void read_head() {
        while (!lines_.at_end()) {
            const Line line = lines_.next();
            const std::string_view text = trimmed(line.text());
            if (text.empty()) continue;
            if (line.text().front() == '#') {
                keys_.read(line);
                continue;
            }
            line.require_text();
            read_header(line);
            keys_.give_to(trace_);
            return;
        }
        const Line end(name_, lines_.lines_read() + 1, "");
        end.fail(0, "the end of the file", kHeaderHelp, "check that this is a trace and that it is complete");
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
        const std::string expected = std::to_string(columns_) + " fields, as in the header";
        if (count == columns_)
            line.fail(offset - 1, "more than " + std::to_string(columns_) + " fields", expected,
                      "delete what is too much");
        line.fail(line.text().size(), std::to_string(count) + (count == 1 ? " field" : " fields"), expected,
                  "complete or delete the line");
    }

    void read_row(const Line& line) {
        line.require_text();
        split(line);
        PoseSample sample;
        sample.t_s = line.number_in(fields_[0], "a time in seconds", kLatest, "1e7");
        Reading& stick = stick_of(line);
        require_later(line, stick, sample.t_s);
        sample.position = read_position(line);
        read_orientation(line, stick, sample);
        stick.trace.samples.push_back(sample);
        stick.last_line = line.number();
    }

    Reading& stick_of(const Line& line) {
        const Field& field = fields_[1];
        if (!sticks_.empty() && sticks_[latest_].trace.name == field.text) return sticks_[latest_];
        const auto known = index_.find(field.text);
        if (known != index_.end()) return sticks_[latest_ = known->second];
        if (field.text.empty() || field.text.size() > kLongestName ||
            field.text.find_first_of(" \t\"'") != std::string_view::npos)
            line.fail(field.offset, "stick name " + in_quotes(field.text),
                      "a word of at most 64 bytes without blanks or quotes", "rename the stick");
        latest_ = sticks_.size();
        index_.emplace(field.text, latest_);
        sticks_.push_back({{std::string(field.text), {}},
                           line.number(),
                           field.offset,
                           line.text(),
                           0,
                           Eigen::Quaterniond::Identity()});
        return sticks_.back();
    }

    void require_later(const Line& line, const Reading& stick, double t) const {
        if (stick.trace.samples.empty() || t > stick.trace.samples.back().t_s) return;
        line.fail(
            fields_[0].offset,
            "sample time " + std::string(fields_[0].text) + " s of stick " + in_quotes(stick.trace.name),
            "later than that of line " + std::to_string(stick.last_line),
            "sort the file or delete the repeated sample");
    }

    Eigen::Vector3d read_position(const Line& line) const {
        const double scale = keys_.metres_per_unit();
        const char* limit = scale == 1 ? "1000 m" : "1000000 mm";
        Eigen::Vector3d p;
        for (int axis = 0; axis < 3; ++axis)
            p[axis] = line.number_in(fields_[static_cast<std::size_t>(axis) + 2], "a coordinate",
                                     kFarthest / scale, limit);
        if (scale != 1) p /= 1000;  // 0.001 is no double: dividing keeps whole mm exact
        return keys_.z_up() ? from_z_up(p) : p;
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

    void read_orientation(const Line& line, Reading& stick, PoseSample& sample) const {
        if (orientation_ == Orientation::absent) return;
        if (orientation_left_out(
                line)) {  // the newest known one, so that the tip stays where the stick last pointed
            if (!stick.trace.samples.empty()) sample.orientation = stick.trace.samples.back().orientation;
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
        if (q.dot(stick.file_orientation) < 0 && !stick.trace.samples.empty()) q.coeffs() = -q.coeffs();
        stick.file_orientation = q;
        sample.orientation = keys_.z_up() ? from_z_up(q) : q;
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

    Trace finish() {
        if (sticks_.empty())
            Line(name_, lines_.lines_read() + 1, "")
                .fail(0, "the end of the file", "at least two samples", "check that the trace is complete");
        for (Reading& stick : sticks_) {
            if (stick.trace.samples.size() < 2)
                Line(name_, stick.first_line, stick.first_text)
                    .fail(stick.first_offset, "one sample of stick " + in_quotes(stick.trace.name),
                          "at least two samples a stick", "delete the line or complete the trace");
            trace_.sticks.push_back(std::move(stick.trace));
        }
        return std::move(trace_);
    }

    const std::string& name_;
    LineReader lines_;
    TraceKeys keys_;
    Trace trace_;
    Orientation orientation_ = Orientation::absent;
    std::size_t columns_ = 5;
    Field fields_[9];
    std::vector<Reading> sticks_;
    std::unordered_map<std::string_view, std::size_t> index_;
    std::size_t latest_ = 0;
};

}  // namespace

Trace parse_trace(std::string_view text, const std::string& name) {
    if (is_bsor(text)) return parse_bsor(text, name);
    if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
    return Reader(text, name).read();
}

}  // namespace tracking
