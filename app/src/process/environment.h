#pragma once

namespace app {

/// Takes the variables by which Mesa draws otherwise, or not at all, out of the environment: frames are the same
/// everywhere. LP_NUM_THREADS, which no pixel depends on, stays. Before there are threads.
void clear_mesa_variables();

/// Fewer files that may be open are too few for a run; ZeroMQ ends a program that has none left.
inline constexpr unsigned kLeastDescriptors = 64;
/// Lets this process have as many files open as it may, and returns how many.
unsigned long raise_descriptor_limit() noexcept;

}  // namespace app
