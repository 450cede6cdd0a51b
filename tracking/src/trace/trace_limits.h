#pragma once
#include <cstddef>

namespace tracking {

// What every reader of traces accepts.
inline constexpr double kLatest = 1e7;           ///< |t| [s]
inline constexpr double kFarthest = 1000;        ///< |coordinate| [m]
inline constexpr double kLargestAngle = 1e6;     ///< |Euler angle| [degrees]
inline constexpr double kNormTolerance = 0.01;   ///< of quaternions, and of a matrix's products of columns
inline constexpr std::size_t kLongestName = 64;  ///< of a stick [bytes]
inline constexpr std::size_t kMostSticks = 64;   ///< of a recording of another program

}  // namespace tracking
