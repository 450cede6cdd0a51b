#pragma once
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace app {

/// A figure of two runs. None: the run does not have it.
struct ComparedFigure {
    std::string name;
    std::optional<double> a, b;

    /// b over a; none where either is missing or a is 0.
    [[nodiscard]] std::optional<double> ratio() const;
};

/// p50, p95, p99, max [ms] of a stage of two runs.
struct ComparedStage {
    std::string name;
    std::array<ComparedFigure, 4> figures;
};

/// Two runs of `latency` side by side.
struct LatencyComparison {
    std::string a, b;                     ///< folders
    std::vector<ComparedStage> stages;    ///< in the order of the first run, then what the second has alone
    std::vector<ComparedFigure> figures;  ///< misses, sound minus picture, leads needed, errors
};

/// Reads latency.json of both folders. Throws BadInput for what `latency` did not write.
[[nodiscard]] LatencyComparison compare_latency(const std::filesystem::path& a,
                                                const std::filesystem::path& b);

[[nodiscard]] std::string format_text(const LatencyComparison& comparison);
/// `a`, `b`, `stages` [{`name`, `a` {`p50_ms`, ...}, `b`, `ratio`}], `figures` [{`name`, `a`, `b`, `ratio`}].
[[nodiscard]] std::string format_json(const LatencyComparison& comparison);
[[nodiscard]] std::string format_page(const LatencyComparison& comparison);

}  // namespace app
