#pragma once

namespace app {

/// What one core of this machine can do at most, measured in a few tenths of a second of processor time.
struct MachineSpeed {
    double flops = 0;  ///< single-precision operations a second, a fused multiply-add counted as two
    double bytes_per_second = 0;  ///< read in order from an array that no cache holds
};
[[nodiscard]] MachineSpeed measure_machine_speed();

}  // namespace app
