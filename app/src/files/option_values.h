#pragma once
#include <Eigen/Core>
#include <string>

namespace app {

/// "0.01", "1e-3" or a fraction "1/15" of an option. Throws BadInput naming the option.
[[nodiscard]] double parse_number(const std::string& text, const std::string& option);
/// "12". Throws BadInput naming the option and the range.
[[nodiscard]] int parse_whole(const std::string& text, const std::string& option, int low, int high);
/// "X,Y,Z", each a number or a fraction. Throws BadInput naming the option.
[[nodiscard]] Eigen::Vector3d parse_vector(const std::string& text, const std::string& option);
/// A body axis: "-z", "+y", "x". Throws BadInput naming the option.
[[nodiscard]] Eigen::Vector3d parse_axis(const std::string& text, const std::string& option);
/// "640x480" as width and height. Throws BadInput naming the option.
[[nodiscard]] Eigen::Vector2i parse_size(const std::string& text, const std::string& option);

}  // namespace app
