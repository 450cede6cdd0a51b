#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracking/trace.h"

namespace tracking {

/// Where a table of another program keeps what a trace needs, and in which units and axes.
///
/// Times are numbers, or ISO 8601 (2026-05-01T12:00:00.25+02:00, 20260501T100000Z, 12:00:00,25), which count
/// from the first row's.
///
/// `columns` maps roles to columns. Roles: `t` or `frame` (neither: rows are frames), `stick` (one row
/// per stick), px py pz, and one of qw qx qy qz | ex ey ez (with `euler`) | m00 m01 .. m22 (rotation matrix,
/// row and column) | nothing. All turn body to world. A role may name its stick: `left.px`. Columns are
///
///   NAME    the header's cell; a header of several lines: its cells from top to bottom, joined by '/',
///           empty ones left out. '*' stands for anything; {stick} for a name without '/': a stick each
///   #N      the N-th column, from 1
///   +N      N columns right of the same stick's px
///   -...    any of these with its sign changed (a name that begins so is named by its number)
struct ColumnMap {
    char separator = ',';  ///< ',' ';' or '\t'; ' ': any run of blanks and tabs
    char comment = 0;      ///< lines that begin with it are left out
    bool decimal_comma = false;
    std::string header;       ///< first cell of the header's last line; empty: the first line that is no
                              ///< comment, or none where all columns are numbers
    std::string header_from;  ///< a cell of the header's first line, among its first two; empty: `header`
    std::map<std::string, std::string> columns;  ///< or, for a C3D file, markers
    std::optional<double> metres_per_unit;       ///< else 0.01 in the frame "unreal", 1 in others
    std::string units_from;  ///< above the header, a cell of this text stands before the unit's name
    bool z_up = false;       ///< (x, y, z) becomes (x, z, -y), as in native files
    std::string
        frame;  ///< where the axes of world and bodies point, three letters of RLUDFB, unity or unreal;
                ///< not with z_up. Tip and shaft are in our axes (forward is -z)
    std::string euler;     ///< order of the intrinsic turns, a permutation of XYZ
    bool radians = false;  ///< of Euler angles; else degrees
    double seconds_per_unit = 1;
    bool from_zero = false;  ///< times count from the first row's
    double rate_hz = 0;      ///< of frames
    std::string rate_from;   ///< above the header, a cell of this text stands before the rate, unless given
    bool zero_is_lost = false;  ///< a position of three zeros means: not seen
    std::string signature;      ///< text within a file's first 2000 bytes that identifies this kind of file
    std::optional<Eigen::Vector3d> tip, shaft;

    /// The roles are `marker`, `marker2` and `marker3` (of a stick: `left.marker`), the columns labels of points ('*'
    /// stands for anything).
    [[nodiscard]] bool of_markers() const;

    /// Throws std::invalid_argument (found, expected) for what cannot be a map.
    void check() const;
};

/// A table's text; `stick` names the stick where the table itself does not.
struct Table {
    std::string text;
    std::string name;  ///< of the file, for messages
    std::string stick = "stick";
};

/// Reads tables of one kind into one trace. Rows in which a stick is not seen (all its cells empty, or `NaN`)
/// are left out and counted in the trace's remarks; a row without orientation is position only. Quaternions
/// take the sign that continues the sample before, so that Euler angles that jump by 360 degrees, or pass
/// through 90, read to continuous ones. Limits as for native traces. Frames and `from_zero` count from the
/// first row of the first table. Throws TraceError with its place; nothing is guessed.
[[nodiscard]] Trace read_tables(const std::vector<Table>& tables, const ColumnMap& map);

/// True for bytes that begin as a C3D file: key 80, and a parameter section that names a processor.
[[nodiscard]] bool is_c3d(std::string_view bytes);

/// Reads the markers of a C3D file (c3d.org). `marker` is the tracked point of a stick. With `marker2`, towards
/// the tip, the shaft points from one to the other (-z), and the tip is there unless the map says it; the body turns
/// about the shaft no further than it must from one frame to the next. With `marker3` its x axis lies on the third
/// marker's side. A stick without its tracked marker is left out of a frame and counted; without another it is position
/// only. A map without columns makes each of up to 64 points a stick.
///
/// Units, rate and axes are the file's (POINT:UNITS, RATE, the axis of X_SCREEN to the right, that of
/// Y_SCREEN up, whatever their signs; z up if they are not said) unless the map has units, a rate, z_up or a frame. Times count from the first frame. Throws TraceError with the byte of
/// the fault, std::invalid_argument for a map of columns.
[[nodiscard]] Trace read_markers(std::string_view bytes, const std::string& name, const ColumnMap& map);

}  // namespace tracking
