#pragma once

/// Allocations by C++ code (operator new) on the threads that count; Csound, being C, is not among them.
namespace allocations {

void count_on_this_thread();
[[nodiscard]] int counted();

}  // namespace allocations
