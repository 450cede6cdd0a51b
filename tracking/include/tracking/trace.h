#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace tracking {

/// One report of a tracked body: metres, right-handed, +y up; orientation is body to world, unit.
struct PoseSample {
    double t_s = 0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    bool has_orientation = false;  ///< false: position only; orientation is then the identity
};

/// Samples of one stick, t_s strictly increasing, at least two.
struct StickTrace {
    std::string name;
    std::vector<PoseSample> samples;
};

/// A recording, already converted to metres and y up whatever the file's units and axes were.
struct Trace {
    std::string file;                      ///< as opened
    std::string source;                    ///< the file's `source` key
    double rate_hz = 0;                    ///< nominal; 0 when the file does not say
    std::optional<Eigen::Vector3d> tip;    ///< tip in the tracked body's frame [m]; key `tip_m`
    std::optional<Eigen::Vector3d> shaft;  ///< unit body axis from hand to tip; key `shaft`
    std::vector<StickTrace> sticks;        ///< in order of first appearance

    [[nodiscard]] double t0_s() const;     ///< earliest sample time of all sticks
    [[nodiscard]] double t_end_s() const;  ///< latest
};

/// Bad input. what() is one line: FILE:LINE:COLUMN: error: found ..., expected ...; what to do.
class TraceError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

/// Reads the native CSV format (optional `# key: value` lines, header t,stick,px,py,pz[,qw,qx,qy,qz | rx,ry,rz | ex,ey,ez]).
/// Nothing is guessed: the first bad line throws TraceError with its place.
[[nodiscard]] Trace read_trace(const std::filesystem::path& file);

/// The same from memory; `name` stands for the file in messages. (Fuzzed.)
[[nodiscard]] Trace parse_trace(std::string_view text, const std::string& name);

/// Native CSV text of a trace, in metres and y up; numbers read back to the same double.
[[nodiscard]] std::string format_trace(const Trace& trace);

}  // namespace tracking
