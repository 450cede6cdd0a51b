#include "bench/bench_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>

namespace app {
namespace {

using Json = nlohmann::ordered_json;

Json result_json(const BenchResult& result) {
    Json json{{"name", result.name}, {"value", result.value}, {"unit", result.unit}};
    json["peer"] = result.peer.empty() ? Json() : Json(result.peer);
    json["peer_version"] = result.peer_version.empty() ? Json() : Json(result.peer_version);
    json["peer_value"] = result.peer_value ? Json(*result.peer_value) : Json();
    json["ratio"] = result.ratio ? Json(*result.ratio) : Json();
    return json;
}

}  // namespace

nlohmann::ordered_json machine_json(const MachineName& machine) {
    return {{"processor", machine.processor},
            {"cores", machine.cores},
            {"compiler", machine.compiler},
            {"avx2", machine.avx2}};
}

std::string format_json(const BenchReport& report) {
    Json json;
    json["machine"] = machine_json(report.machine);
    json["results"] = Json::array();
    for (const BenchResult& result : report.results) json["results"].push_back(result_json(result));
    json["notes"] = report.notes;
    return json.dump(2) + "\n";
}

std::string format_text(const BenchReport& report) {
    std::string text = fmt::format("{}, {} cores, {}{}\n\n", report.machine.processor, report.machine.cores,
                                   report.machine.compiler, report.machine.avx2 ? "" : ", without AVX2");
    const auto out = std::back_inserter(text);
    std::size_t width = 42;
    for (const BenchResult& r : report.results) width = std::max(width, r.name.size());
    for (const BenchResult& r : report.results) {
        fmt::format_to(out, "{:<{}} {:>10.4g} {:<18}", r.name, width, r.value, r.unit);
        if (r.ratio)
            fmt::format_to(out, " {:.3f} x {} {} ({:.4g})", *r.ratio, r.peer, r.peer_version,
                           r.peer_value.value_or(0));
        text += '\n';
    }
    text += '\n';
    for (const std::string& note : report.notes) text += note + '\n';
    return text;
}

}  // namespace app
