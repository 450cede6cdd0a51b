#include "latency/latency_comparison.h"

#include <fmt/format.h>
#include <tracking/input.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>

#include "files/bad_input.h"
#include "report/html.h"
#include "report/json_document.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 4> kQuantiles = {"p50_ms", "p95_ms", "p99_ms", "max_ms"};

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& found) {
    throw BadInput(
        fmt::format("{}: error: found {}, expected what `musicworld latency --out DIR` writes; name "
                    "such a folder",
                    file.string(), found));
}

/// What `latency` wrote, its stages by name.
Json read_document(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / "latency.json";
    std::error_code error;
    if (!std::filesystem::exists(file, error)) refuse(file, "no such file");
    Json json = Json::parse(tracking::read_bytes(file.string(), "what latency measured"), nullptr, false);
    if (json.is_discarded()) refuse(file, "a text that is not JSON");
    if (!json.is_object() || !json.contains("stages") || !json["stages"].is_array())
        refuse(file, "no stages");
    Json stages = Json::object();
    for (const Json& stage : json["stages"]) {
        if (!stage.is_object() || !stage.contains("name") || !stage["name"].is_string())
            refuse(file, "a stage without a name");
        const std::string name = stage["name"];
        if (!stages.contains(name)) stages[name] = stage;
    }
    json["stages"] = stages;
    return json;
}

/// The number at a JSON pointer, if there is one.
std::optional<double> number(const Json& json, const std::string& pointer) {
    const Json::json_pointer at(pointer);
    if (!json.contains(at) || !json.at(at).is_number()) return std::nullopt;
    return json.at(at).get<double>();
}

/// A's value, B's, and their ratio.
std::array<Cell, 3> compared(const std::optional<double>& a, const std::optional<double>& b) {
    return {a, b, a && b && *a != 0 ? std::optional(*b / *a) : std::nullopt};
}

Table compared_stages(const Json& a, const Json& b) {
    Table table = Table::of({"name"});
    for (const std::string key : kQuantiles)
        table.columns.insert(table.columns.end(),
                             {{"a/" + key, ".3f"}, {"b/" + key, ".3f"}, {"ratio/" + key, ".2f"}});
    Json all = a["stages"];
    all.update(b["stages"]);  // adds those that B has alone
    for (const auto& stage : all.items()) {
        Cells row = {stage.key()};
        for (const std::string key : kQuantiles) {
            const auto value = [&](const Json& document) {
                return number(document["stages"].value(stage.key(), Json::object()), "/" + key);
            };
            std::ranges::copy(compared(value(a), value(b)), std::back_inserter(row));
        }
        table.add(std::move(row));
    }
    return table;
}

Table compared_figures(const Json& a, const Json& b) {
    constexpr std::pair<const char*, const char*> kFigures[] = {
        {"frames", "/frames/total"},
        {"frames missed", "/frames/missed"},
        {"notes", "/notes/total"},
        {"notes late", "/notes/late"},
        {"samples skipped", "/samples/skipped"},
        {"strokes missed", "/strokes/missed"},
        {"sound minus picture, p5 ms", "/sound_minus_picture_ms/p5"},
        {"sound minus picture, median ms", "/sound_minus_picture_ms/median"},
        {"sound minus picture, p95 ms", "/sound_minus_picture_ms/p95"},
        {"lead that pictures need, ms", "/lead_needed_ms/render"},
        {"lead that sound needs, ms", "/lead_needed_ms/sound"},
        {"RMS error on the screen, mm", "/drawn_error_mm/rms"}};
    Table table = Table::of({"name", "a:.1f", "b:.1f", "ratio:.2f"});
    for (const auto& [name, pointer] : kFigures) {
        const auto [in_a, in_b, ratio] = compared(number(a, pointer), number(b, pointer));
        table.add({name, in_a, in_b, ratio});
    }
    return table;
}

}  // namespace

LatencyComparison compare_latency(const std::filesystem::path& folder_a,
                                  const std::filesystem::path& folder_b) {
    const Json a = read_document(folder_a), b = read_document(folder_b);
    return {folder_a.string(), folder_b.string(), compared_stages(a, b), compared_figures(a, b)};
}

std::string format_text(const LatencyComparison& c) {
    return fmt::format("A {}\nB {}\n\n{}\n{}", c.a, c.b, c.stages.text(), c.figures.text());
}

std::string format_json(const LatencyComparison& c) {
    const Json json = {{"a", c.a}, {"b", c.b}, {"stages", c.stages.json()}, {"figures", c.figures.json()}};
    return json_document(json);
}

std::string format_page(const LatencyComparison& c) {
    constexpr const char* kTitle = "Latency of two runs";
    return report_page(kTitle, report_header(kTitle, "", {{"A", c.a}, {"B", c.b}}) +
                                   "<h2>Stages</h2>\n<p class=note>Milliseconds; a ratio below 1: B is "
                                   "faster.</p>\n" +
                                   c.stages.html() + "<h2>Figures</h2>\n" + c.figures.html());
}

}  // namespace app
