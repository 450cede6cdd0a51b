#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "trace/binary_place.h"
#include "trace/c3d_file.h"
#include "trace/column_finder.h"
#include "trace/orientation_forms.h"
#include "trace/stick_names.h"
#include "trace/text_cursor.h"
#include "trace/trace_limits.h"
#include "tracking/import.h"

namespace tracking {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kNearest = 1e-3;  // m between markers that give a direction

/// The markers of a stick, by their place among the file's points: the tracked one, one towards the tip, one beside.
struct Markers {
    std::string stick;
    std::vector<std::size_t> points;
};

/// -z from the first marker to the second; x towards the third, at a right angle. With two markers the body turns about
/// its shaft no further than it must from `before` on. None where they lie too near to say.
std::optional<Quaterniond> orientation(const std::vector<Vector3d>& p,
                                       const std::optional<Quaterniond>& before) {
    const Vector3d shaft = p[1] - p[0];
    if (!(shaft.norm() > kNearest)) return std::nullopt;
    const Vector3d z = -shaft.normalized();
    if (p.size() == 2) {
        const Quaterniond q = before.value_or(Quaterniond::Identity());
        return (Quaterniond::FromTwoVectors(q * Vector3d::UnitZ(), z) * q).normalized();
    }
    const Vector3d beside = p[2] - p[0];
    const Vector3d across = beside - beside.dot(z) * z;
    if (!(across.norm() > kNearest)) return std::nullopt;
    Eigen::Matrix3d r;
    r.col(0) = across.normalized();
    r.col(1) = z.cross(r.col(0));
    r.col(2) = z;
    return Quaterniond(r).normalized();
}

class MarkerReader {
public:
    MarkerReader(std::string_view bytes, const std::string& name, const ColumnMap& map)
        : file_(bytes, name), name_(name), map_(map) {
        metres_ = map.metres_per_unit ? map.metres_per_unit : file_.metres_per_unit();
        if (!metres_)
            fail_at_byte(name, 0, "units of points that are no length", "POINT:UNITS mm, cm or m",
                         "say the unit (--units)");
        axes_ = file_.axes();
        if (map.z_up) axes_ = *axes_of("RFU");
        if (!map.frame.empty()) axes_ = *axes_of(map.frame);
        rate_hz_ = map.rate_hz > 0 ? map.rate_hz : file_.rate_hz();
    }

    Trace read() {
        Trace trace;
        trace.file = name_;
        trace.source = "C3D";
        trace.rate_hz = rate_hz_;
        for (const Markers& markers : chosen()) read_stick(markers, trace);
        if (trace.sticks.empty())
            fail_at_byte(name_, file_.byte_of(0, 0), "no point that was seen twice", "at least one",
                         "check the markers' names");
        if (!lengths_.empty()) {
            std::nth_element(lengths_.begin(), lengths_.begin() + std::ssize(lengths_) / 2, lengths_.end());
            trace.shaft = -Vector3d::UnitZ();
            trace.tip = Vector3d(0, 0, -lengths_[lengths_.size() / 2]);
        }
        if (map_.tip) trace.tip = map_.tip;
        if (map_.shaft) trace.shaft = map_.shaft;
        return trace;
    }

private:
    /// The map's sticks; without a map each point is one.
    [[nodiscard]] std::vector<Markers> chosen() const {
        std::vector<Markers> all;
        if (!map_.columns.empty()) {
            std::map<std::string, std::vector<std::string>>
                wanted;  // marker, marker2, marker3: in this order
            for (const auto& [role, label] : map_.columns) wanted[split_role(role).first].push_back(label);
            for (const auto& [stick, labels] : wanted) {
                all.push_back({stick.empty() ? "stick" : stick, {}});
                for (const std::string& label : labels) all.back().points.push_back(point_named(label));
            }
            return all;
        }
        if (file_.labels().size() > kMostSticks)
            fail_at_byte(name_, 2, std::to_string(file_.labels().size()) + " points",
                         "at most 64 without a map",
                         "name the sticks' markers, such as --map \"left.marker=" + label(0) +
                             ",left.marker2=" + label(1) + "\"");
        std::set<std::string> names;
        for (std::size_t i = 0; i < file_.labels().size(); ++i)
            all.push_back({unique_name(label(i), "point", i + 1, names), {i}});
        return all;
    }

    [[nodiscard]] std::string label(std::size_t i) const { return stick_word(file_.labels()[i]); }

    [[nodiscard]] std::size_t point_named(const std::string& pattern) const {
        const std::vector<std::string>& labels = file_.labels();
        const auto is_it = [&](const std::string& label) { return matches(pattern, label); };
        const auto found = std::find_if(labels.begin(), labels.end(), is_it);
        if (found == labels.end()) {
            std::string known;
            for (std::size_t i = 0; i < labels.size() && i < 12; ++i)
                known += (i == 0 ? "" : ", ") + in_quotes(labels[i]);
            fail_at_byte(name_, 0, "no point " + in_quotes(pattern), "one of " + known, "correct the map");
        }
        if (std::find_if(found + 1, labels.end(), is_it) != labels.end())
            fail_at_byte(name_, 0, "two points " + in_quotes(pattern), "one", "name it without '*'");
        return static_cast<std::size_t>(found - labels.begin());
    }

    /// In metres and our axes.
    [[nodiscard]] std::optional<Vector3d> point(std::size_t frame, std::size_t which) const {
        std::optional<Vector3d> p = file_.point(frame, which);
        if (!p || (map_.zero_is_lost && p->isZero(0))) return std::nullopt;
        *p /= 1 / *metres_;
        if (!(p->cwiseAbs().maxCoeff() <= kFarthest))
            fail_at_byte(name_, file_.byte_of(frame, which), "a coordinate that is no number within 1000 m",
                         "metres", "check the units and the scale");
        return axes_ * *p;
    }

    void read_stick(const Markers& markers, Trace& trace) {
        StickTrace stick{markers.stick, {}};
        std::optional<Quaterniond> before;
        std::size_t not_seen = 0;
        std::vector<Vector3d> p;
        for (std::size_t k = 0; k < file_.frames(); ++k) {
            p.clear();
            for (const std::size_t which : markers.points)
                if (const std::optional<Vector3d> seen = point(k, which))
                    p.push_back(*seen);
                else if (p.empty())
                    break;
            if (p.empty()) {
                ++not_seen;
                continue;
            }
            PoseSample sample;
            sample.t_s = static_cast<double>(k) / rate_hz_;
            sample.position = p[0];
            std::optional<Quaterniond> q;
            if (p.size() == markers.points.size() && p.size() > 1) q = orientation(p, before);
            if (q && before && q->dot(*before) < 0) q->coeffs() = -q->coeffs();
            if (q) lengths_.push_back((p[1] - p[0]).norm()), before = q;
            sample.has_orientation = q.has_value();
            sample.orientation = before.value_or(Quaterniond::Identity());
            stick.samples.push_back(sample);
        }
        if (not_seen > 0)
            trace.remarks.push_back("left out " + std::to_string(not_seen) + " frames in which " +
                                    stick.name + " was not seen");
        if (stick.samples.size() >= 2) trace.sticks.push_back(std::move(stick));
    }

    C3dFile file_;
    const std::string& name_;
    const ColumnMap& map_;
    std::optional<double> metres_;
    Eigen::Matrix3d axes_;
    double rate_hz_ = 0;
    std::vector<double> lengths_;  // from the first marker to the second [m]
};

}  // namespace

Trace read_markers(std::string_view bytes, const std::string& name, const ColumnMap& map) {
    if (map.columns.empty())
        check_units(map);
    else
        map.check();
    if (!map.columns.empty() && !map.of_markers())
        throw std::invalid_argument(
            "map: error: found columns of a table, expected markers of a C3D file, such as "
            "left.marker=LABEL");
    return MarkerReader(bytes, name, map).read();
}

}  // namespace tracking
