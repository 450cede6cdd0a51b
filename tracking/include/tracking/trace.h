#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tracking {

/// One report of a tracked body: metres, right-handed, +y up; orientation is body to world, unit.
struct PoseSample {
    double t_s = 0;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    bool has_orientation =
        false;  ///< false: position only; orientation is then the newest known one (the identity before any)
};

/// Longest pause between two samples of a stick that is bridged; after a longer one estimators start anew.
inline constexpr double kGapS = 0.1;

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
    std::vector<std::string> remarks;      ///< what an importer left out, a line each; not written to files

    [[nodiscard]] double t0_s() const;     ///< earliest sample time of all sticks
    [[nodiscard]] double t_end_s() const;  ///< latest
};

/// Bad input. what() is one line: FILE:LINE:COLUMN (FILE:byte N in binary files): error: found ..., expected
/// ...; what to do. What in it cannot be printed becomes '?'.
class TraceError : public std::runtime_error {
public:
    explicit TraceError(std::string_view text);
};

/// Reads the native CSV format: optional `# key: value` lines, then the header t,stick,px,py,pz and, if the
/// orientation is known, one of ,qw,qx,qy,qz | ,rx,ry,rz | ,ex,ey,ez; then one row per sample. Nothing is
/// guessed: the first bad line throws TraceError with its place.
///
///   keys         units (m|cm|mm, of px, py, pz), up (y|z), frame (unity|unreal|RUF, ..), rate_hz, source,
///                tip_m (x,y,z in metres whatever `units` says), shaft (+x|-x|+y|-y|+z|-z);
///                tip and shaft are in the body's frame as it is read: `up` and `frame` do not turn them.
///                Other keys are comments, except near misses of these (`unit:`), which are errors.
///   q columns    body to world, norm within 1 % of 1 (then normalised; the sign that continues the sample
///                before is taken); all four empty: position only
///   r columns    rotation vector [rad, body frame] since the stick's sample before,
///                q_k = q_(k-1) exp(r_k), q_(-1) = 1
///   e columns    degrees, intrinsic X-Y-Z: q = q_x q_y q_z; all three empty: position only
///   up: z        (x, y, z) becomes (x, z, -y) and q becomes (sqrt 1/2, -sqrt 1/2, 0, 0) q
///   frame        other axes, of world and bodies: right-handed or left-handed ones become ours by p' = M p,
///                R' = M R M^T (unity: (x, y, -z) and (w, -x, -y, z); unreal: (y, z, -x) and (w, -y, -z, x),
///                in cm unless `units` says otherwise)
///   limits       |coordinate| <= 1000 m, |t| <= 1e7 s; per stick t increases strictly, at least two samples;
///                UTF-8 without control characters, at most 1 GiB; LF or CRLF; a byte order mark is skipped
///
/// A file that begins as an Extended Reality Open Recording (`*.xror`, xror_reader.h) or a C3D file (`*.c3d`,
/// import.h, each point a stick) is read as one.
///
/// A file that begins as a Beat Saber Open Replay (`*.bsor`) is read as one: the sabers `left` and `right`,
/// mirrored to right-handed axes, tip (0, 0, -0.35). Frames that do not advance and the start-up are left
/// out and counted in `remarks`; places of faults are FILE:byte N.
[[nodiscard]] Trace read_trace(const std::filesystem::path& file);

/// The same from memory; `name` stands for the file in messages. (Fuzzed.)
[[nodiscard]] Trace parse_trace(std::string_view text, const std::string& name);

/// Native CSV text of a trace, in metres and y up, rows in order of time; numbers read back to the same
/// double. Throws std::invalid_argument for what the format cannot hold: a stick name that is not a word, a
/// shaft off the axes, a source of several lines.
[[nodiscard]] std::string format_trace(const Trace& trace);

}  // namespace tracking
