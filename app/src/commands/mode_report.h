#pragma once
#include <sim/modes.h>

#include <string>

namespace app {

/// The free vibration modes of one body, with what the mesh errs.
struct ModeReport {
    sim::ModesRequest request;
    std::string shape;  ///< as asked for: "box", "cylinder" ...
    sim::FreeVibrationModes modes;
    Eigen::VectorXd errors;  ///< of the frequencies, relative; NaN: not known
};
/// Throws std::invalid_argument, std::runtime_error.
[[nodiscard]] ModeReport make_mode_report(const sim::ModesRequest& request, const std::string& shape);

/// "stretching", "bending x", "shear xy", "twisting"; of rigid modes "translation x", "rotation z".
[[nodiscard]] std::string mode_kind(int parity, bool rigid);

/// A table for people.
[[nodiscard]] std::string format_mode_table(const ModeReport& report);
/// The document of `modes --json`: lists over all modes, the six rigid ones first; an unknown error is null.
[[nodiscard]] std::string format_mode_json(const ModeReport& report);

}  // namespace app
