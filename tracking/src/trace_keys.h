#pragma once
#include <optional>
#include <set>
#include <string>

#include "text_cursor.h"
#include "tracking/trace.h"

namespace tracking {

/// What the `# key: value` lines of a trace say.
class TraceKeys {
public:
    /// Takes one line that starts with '#'. Throws TraceError for a bad value, a repeated key, or a near miss
    /// of a key.
    void read(const Line& line);

    [[nodiscard]] double metres_per_unit() const { return metres_per_unit_; }
    [[nodiscard]] bool z_up() const { return z_up_; }
    /// Moves rate, source, tip and shaft into the trace.
    void give_to(Trace& trace) const;

private:
    void set(const Line& line, const std::string& key, const Field& value);
    void set_tip(const Line& line, const Field& value);
    void set_shaft(const Line& line, const Field& value);

    std::set<std::string> seen_;
    double metres_per_unit_ = 1;
    bool z_up_ = false;
    double rate_hz_ = 0;
    std::string source_;
    std::optional<Eigen::Vector3d> tip_;
    std::optional<Eigen::Vector3d> shaft_;
};

}  // namespace tracking
