#pragma once
#include <filesystem>
#include <string>

#include "report/table.h"

namespace app {

/// Two runs of `latency` side by side. A ratio is B over A, none where either is missing or A is 0.
struct LatencyComparison {
    std::string a, b;  ///< folders
    /// `name`, then `a/p50_ms`, `b/p50_ms`, `ratio/p50_ms` and so on for p95, p99 and max; in the order of
    /// the first run, then what the second has alone.
    Table stages;
    Table figures;  ///< `name`, `a`, `b`, `ratio`: misses, sound minus picture, leads needed, errors
};

/// Reads latency.json of both folders. Throws BadInput for what `latency` did not write.
[[nodiscard]] LatencyComparison compare_latency(const std::filesystem::path& a,
                                                const std::filesystem::path& b);

[[nodiscard]] std::string format_text(const LatencyComparison& comparison);
/// `a`, `b`, `stages` [{`name`, `a` {`p50_ms`, ...}, `b`, `ratio`}], `figures` [{`name`, `a`, `b`, `ratio`}].
[[nodiscard]] std::string format_json(const LatencyComparison& comparison);
[[nodiscard]] std::string format_page(const LatencyComparison& comparison);

}  // namespace app
