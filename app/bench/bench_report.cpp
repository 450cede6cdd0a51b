#include "bench/bench_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "report/json_document.h"
#include "report/table.h"

namespace app {
namespace {

Table table_of(const std::vector<BenchResult>& results) {
    Table table =
        Table::of({"name", "value:.4g", "unit", "peer", "peer_version", "peer_value:.4g", "ratio:.3f"});
    for (const BenchResult& r : results)
        table.add({r.name, r.value, r.unit, r.peer, r.peer_version, r.peer_value, r.ratio});
    return table;
}

}  // namespace

std::string lower(std::string name) {
    std::ranges::transform(name, name.begin(), [](unsigned char c) { return std::tolower(c); });
    return name;
}

MachineName machine_name() {
    MachineName name;
    name.cores = std::thread::hardware_concurrency();
    name.compiler = "gcc " __VERSION__;
#ifndef __AVX2__
    name.avx2 = false;
#endif
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        const std::size_t colon = line.find(": ");
        if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
            name.processor = line.substr(colon + 2);
            break;
        }
    }
    return name;
}

nlohmann::ordered_json machine_json(const MachineName& machine) {
    return {{"processor", machine.processor},
            {"cores", machine.cores},
            {"compiler", machine.compiler},
            {"avx2", machine.avx2}};
}

Figures figures_of(const BenchReport& report) {
    const Table table = table_of(report.results);
    const nlohmann::ordered_json json = {
        {"machine", machine_json(report.machine)}, {"results", table.json()}, {"notes", report.notes}};
    std::string text =
        fmt::format("{}, {} cores, {}{}\n\n{}\n", report.machine.processor, report.machine.cores,
                    report.machine.compiler, report.machine.avx2 ? "" : ", without AVX2", table.text());
    for (const std::string& note : report.notes) text += note + '\n';
    return {text, json_document(json)};
}

}  // namespace app
