#pragma once
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "report/plot.h"

namespace app {

/// Processor, cores and compiler.
struct MachineName {
    std::string processor, compiler;
    unsigned cores = 0;
    bool avx2 = true;  ///< false: built for any x86-64
};
[[nodiscard]] MachineName machine_name();

[[nodiscard]] std::string lower(std::string name);  ///< as it stands in a figure's name

/// One measured figure; beside a peer's, where there is one.
struct BenchResult {
    std::string name;
    double value = 0;  ///< ours
    std::string unit;
    std::optional<std::string> peer = {}, peer_version = {};
    std::optional<double> peer_value = {};
    std::optional<double> ratio = {};  ///< ours / peer's, median over the rounds: below 1 is faster
};

struct BenchReport {
    MachineName machine = machine_name();
    std::vector<BenchResult> results = {};
    std::vector<std::string> notes = {};  ///< what was measured and how, lines
};

/// A page whose plots are still to be drawn, see PlotGallery.
struct BenchPage {
    std::string text;
    PlotGallery plots;
};

/// A benchmark's figures as text and as one JSON document, and what else goes into its folder, by file name.
struct Figures {
    std::string text, json;
    std::map<std::string, std::string> tables = {};
    std::map<std::string, PlotScript> plots = {};
    std::map<std::string, BenchPage> pages = {};
};

/// What every benchmark's JSON says of the machine.
[[nodiscard]] nlohmann::ordered_json machine_json(const MachineName& machine);

/// Machine, results and notes.
[[nodiscard]] Figures figures_of(const BenchReport& report);

}  // namespace app
