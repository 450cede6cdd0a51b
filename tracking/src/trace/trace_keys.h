#pragma once
#include <optional>
#include <set>
#include <string>

#include "trace/text_cursor.h"
#include "tracking/trace.h"

namespace tracking {

/// What the `# key: value` lines of a trace say.
class TraceKeys {
public:
    /// Takes one line that starts with '#'. Throws TraceError for a bad value, a repeated key, or a near miss
    /// of a key.
    void read(const Line& line);

    [[nodiscard]] double units_per_metre() const { return units_per_metre_.value_or(unreal_ ? 100 : 1); }
    [[nodiscard]] bool z_up() const { return z_up_; }
    /// What takes the file's axes to ours, of world and bodies; none if they are ours, but for z up.
    [[nodiscard]] const std::optional<Eigen::Matrix3d>& axes() const { return axes_; }
    /// Moves rate, source, tip and shaft into the trace.
    void give_to(Trace& trace) const;

private:
    void set(const Line& line, const std::string& key, const Field& value);
    void require_up_or_frame(const Line& line, const Field& value) const;
    void set_tip(const Line& line, const Field& value);
    void set_shaft(const Line& line, const Field& value);

    std::set<std::string> seen_;
    std::optional<double> units_per_metre_;
    bool z_up_ = false, unreal_ = false;
    std::optional<Eigen::Matrix3d> axes_;
    double rate_hz_ = 0;
    std::string source_;
    std::optional<Eigen::Vector3d> tip_;
    std::optional<Eigen::Vector3d> shaft_;
};

}  // namespace tracking
