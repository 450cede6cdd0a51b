#pragma once
#include <cstdint>

namespace app {

/// CLOCK_MONOTONIC now, which all processes of a machine share [ns].
[[nodiscard]] std::int64_t monotonic_ns() noexcept;
/// Sleeps until that time; returns at once if it has passed.
void sleep_until_ns(std::int64_t time_ns) noexcept;

}  // namespace app
