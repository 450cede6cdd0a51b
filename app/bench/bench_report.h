#pragma once
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "bench/machine_speed.h"
#include "statistics/statistics.h"

namespace app {

/// One measured figure; beside a peer's, where there is one.
struct BenchResult {
    std::string name;
    double value = 0;  ///< ours
    std::string unit;
    std::string peer = {}, peer_version = {};
    std::optional<double> peer_value = {};
    std::optional<double> ratio = {};  ///< ours / peer's, median over the rounds: below 1 is faster
};

struct BenchReport {
    MachineName machine;
    std::vector<BenchResult> results;
    std::vector<std::string> notes;  ///< what was measured and how, lines
};

/// What every benchmark's JSON says of the machine.
[[nodiscard]] nlohmann::ordered_json machine_json(const MachineName& machine);

/// One JSON document: machine, results, notes.
[[nodiscard]] std::string format_json(const BenchReport& report);
/// The same as lines of a table.
[[nodiscard]] std::string format_text(const BenchReport& report);

}  // namespace app
