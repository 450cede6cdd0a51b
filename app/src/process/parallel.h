#pragma once
#include <cstddef>
#include <functional>

namespace app {

/// Calls work(0) ... work(count - 1), each once, on up to `threads` threads; which thread runs which is open,
/// so each call writes to a place of its own. `done` (may be empty) gets the share done, from the calling
/// thread. After all have stopped the first exception, if any, is thrown again.
void parallel_for(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work,
                  const std::function<void(double)>& done = {});

/// Threads worth starting on this machine, at most 8.
[[nodiscard]] unsigned worthwhile_threads();

}  // namespace app
