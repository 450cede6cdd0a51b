// Tables of other programs. The first byte says of which kind.
#include "fuzz_target.h"
#include "tracking/import.h"

namespace {

tracking::ColumnMap map_of(unsigned char kind) {
    tracking::ColumnMap map;
    switch (kind % 4) {
        case 0:  // Euler angles in degrees, frames, a rate above the header
            map.header = "Frame", map.units_from = "Length Units", map.rate_from = "Export Frame Rate";
            map.columns = {{"frame", "Frame"},           {"px", "{stick}/Position/X"},
                           {"py", "{stick}/Position/Y"}, {"pz", "{stick}/Position/Z"},
                           {"ex", "{stick}/Rotation/X"}, {"ey", "{stick}/Rotation/Y"},
                           {"ez", "{stick}/Rotation/Z"}};
            map.euler = "XYZ", map.header_from = "Type";
            break;
        case 1:  // blanks, no header, quaternions
            map.separator = ' ', map.comment = '#', map.from_zero = true;
            map.columns = {{"t", "#1"},  {"px", "#2"}, {"py", "#3"}, {"pz", "#4"},
                           {"qx", "#5"}, {"qy", "#6"}, {"qz", "#7"}, {"qw", "#8"}};
            break;
        case 2:  // matrices, decimal commas, millimetres
            map.separator = ';', map.decimal_comma = true, map.metres_per_unit = 1e-3, map.z_up = true;
            map.zero_is_lost = true, map.rate_hz = 100, map.header = "X";
            map.columns = {{"px", "X"}, {"py", "Y"}, {"pz", "Z"}};
            for (int i = 0; i < 9; ++i)
                map.columns["m" + std::to_string(i / 3) + std::to_string(i % 3)] = "R" + std::to_string(i);
            break;
        default:  // one stick a row
            map.separator = '\t', map.seconds_per_unit = 1e-6;
            map.columns = {{"t", "time*"}, {"stick", "name"}, {"px", "x"}, {"py", "+1"}, {"pz", "+2"}};
    }
    return map;
}

}  // namespace

void fuzz_table(std::string_view bytes) {
    if (bytes.empty()) return;
    try {
        const tracking::Trace trace = tracking::read_tables({{std::string(bytes.substr(1)), "fuzz"}},
                                                            map_of(static_cast<unsigned char>(bytes[0])));
        require(!trace.sticks.empty(), "a trace without sticks");
        (void)tracking::format_trace(trace);
    } catch (const tracking::TraceError& fault) {
        require_located(fault, "fuzz:");
    }
}
