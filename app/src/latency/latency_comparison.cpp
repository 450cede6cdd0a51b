#include "latency/latency_comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "files/bad_input.h"
#include "report/html.h"
#include "report/report_style.h"
#include "statistics/statistics.h"

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

Json read_document(const std::filesystem::path& folder) {
    const std::filesystem::path file = folder / "latency.json";
    std::ifstream in(file);
    if (!in) refuse(file, "no such file");
    Json json = Json::parse(in, nullptr, false);
    if (json.is_discarded()) refuse(file, "a text that is not JSON");
    if (!json.is_object() || !json.contains("stages") || !json["stages"].is_array())
        refuse(file, "no stages");
    for (const Json& stage : json["stages"])
        if (!stage.is_object() || !stage.contains("name") || !stage["name"].is_string())
            refuse(file, "a stage without a name");
    return json;
}

/// The number at a JSON pointer, if there is one.
std::optional<double> number(const Json& json, const std::string& pointer) {
    const Json::json_pointer at(pointer);
    if (!json.contains(at) || !json.at(at).is_number()) return std::nullopt;
    return json.at(at).get<double>();
}

const Json* stage_named(const Json& document, const std::string& name) {
    const Json& stages = document["stages"];
    const auto stage =
        std::find_if(stages.begin(), stages.end(), [&](const Json& s) { return s["name"] == name; });
    return stage == stages.end() ? nullptr : &*stage;
}

ComparedStage compared_stage(const Json& a, const Json& b, const std::string& name) {
    ComparedStage stage;
    stage.name = name;
    const auto value = [&](const Json& document, const char* key) {
        const Json* found = stage_named(document, name);
        return found == nullptr ? std::nullopt : number(*found, std::string("/") + key);
    };
    for (std::size_t i = 0; i < kQuantiles.size(); ++i)
        stage.figures[i] = {kQuantiles[i], value(a, kQuantiles[i]), value(b, kQuantiles[i])};
    return stage;
}

std::vector<std::string> stage_names(const Json& a, const Json& b) {
    std::vector<std::string> names;
    for (const Json* document : {&a, &b})
        for (const Json& stage : (*document)["stages"])
            if (std::find(names.begin(), names.end(), stage["name"]) == names.end())
                names.push_back(stage["name"]);
    return names;
}

std::string cell(const std::optional<double>& value, int decimals) {
    return value ? fmt::format("{:.{}f}", *value, decimals) : "-";
}

std::string ratio_cell(const ComparedFigure& figure) {
    return cell(figure.ratio(), 2);
}

Json json_of(const std::optional<double>& value) {
    return value ? Json(*value) : Json();
}

}  // namespace

std::optional<double> ComparedFigure::ratio() const {
    return a && b && *a != 0 ? std::optional(*b / *a) : std::nullopt;
}

LatencyComparison compare_latency(const std::filesystem::path& folder_a,
                                  const std::filesystem::path& folder_b) {
    const Json a = read_document(folder_a), b = read_document(folder_b);
    LatencyComparison comparison{folder_a.string(), folder_b.string(), {}, {}};
    for (const std::string& name : stage_names(a, b)) comparison.stages.push_back(compared_stage(a, b, name));
    constexpr std::pair<const char*, const char*> kFigures[] = {
        {"frames", "/frames/total"},
        {"frames missed", "/frames/missed"},
        {"notes", "/notes/total"},
        {"notes late", "/notes/late"},
        {"sound minus picture, p5 ms", "/sound_minus_picture_ms/p5"},
        {"sound minus picture, median ms", "/sound_minus_picture_ms/median"},
        {"sound minus picture, p95 ms", "/sound_minus_picture_ms/p95"},
        {"lead that pictures need, ms", "/lead_needed_ms/render"},
        {"lead that sound needs, ms", "/lead_needed_ms/sound"},
        {"RMS error on the screen, mm", "/drawn_error_mm/rms"}};
    for (const auto& [name, pointer] : kFigures)
        comparison.figures.push_back({name, number(a, pointer), number(b, pointer)});
    return comparison;
}

std::string format_text(const LatencyComparison& c) {
    std::string text = fmt::format("A {}\nB {}\n\n{:<19}", c.a, c.b, "stage, ms");
    const auto out = std::back_inserter(text);
    for (const char* quantile : {"p50", "p95", "p99", "max"})
        fmt::format_to(out, " {:>9} {:>9} {:>7}", fmt::format("A {}", quantile),
                       fmt::format("B {}", quantile), "B/A");
    for (const ComparedStage& stage : c.stages) {
        fmt::format_to(out, "\n{:<19}", stage.name);
        for (const ComparedFigure& f : stage.figures)
            fmt::format_to(out, " {:>9} {:>9} {:>7}", cell(f.a, 3), cell(f.b, 3), ratio_cell(f));
    }
    fmt::format_to(out, "\n\n{:<31} {:>9} {:>9} {:>7}\n", "", "A", "B", "B/A");
    for (const ComparedFigure& f : c.figures)
        fmt::format_to(out, "{:<31} {:>9} {:>9} {:>7}\n", f.name, cell(f.a, 1), cell(f.b, 1), ratio_cell(f));
    return text;
}

std::string format_json(const LatencyComparison& c) {
    Json stages = Json::array(), figures = Json::array();
    for (const ComparedStage& stage : c.stages) {
        Json row = {
            {"name", stage.name}, {"a", Json::object()}, {"b", Json::object()}, {"ratio", Json::object()}};
        for (const ComparedFigure& f : stage.figures) {
            row["a"][f.name] = json_of(f.a);
            row["b"][f.name] = json_of(f.b);
            row["ratio"][f.name] = json_of(f.ratio());
        }
        stages.push_back(row);
    }
    for (const ComparedFigure& f : c.figures)
        figures.push_back(
            {{"name", f.name}, {"a", json_of(f.a)}, {"b", json_of(f.b)}, {"ratio", json_of(f.ratio())}});
    const Json json = {{"a", c.a}, {"b", c.b}, {"stages", stages}, {"figures", figures}};
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string format_page(const LatencyComparison& c) {
    std::string body =
        fmt::format("<header><h1>Latency of two runs</h1>\n<dl class=facts>\n{}{}</dl></header>\n",
                    report_fact("A", c.a), report_fact("B", c.b));
    const auto out = std::back_inserter(body);
    const auto cells = [&](const ComparedFigure& f, int decimals) {
        fmt::format_to(out, "<td class=n>{}<td class=n>{}<td class=n><b>{}</b>", cell(f.a, decimals),
                       cell(f.b, decimals), ratio_cell(f));
    };
    body +=
        "<h2>Stages</h2>\n<p class=note>Milliseconds; B/A below 1: B is faster.</p>\n<div "
        "class=scroll><table "
        "class=wide><tr><th>stage";
    for (const char* quantile : {"p50", "p95", "p99", "max"})
        fmt::format_to(out, "<th class=n>A {0}<th class=n>B {0}<th class=n>B/A", quantile);
    body += "</tr>\n";
    for (const ComparedStage& stage : c.stages) {
        fmt::format_to(out, "<tr><td>{}", html(stage.name));
        for (const ComparedFigure& f : stage.figures) cells(f, 3);
        body += "</tr>\n";
    }
    body +=
        "</table></div>\n<h2>Figures</h2>\n<table><tr><th><th class=n>A<th class=n>B<th class=n>B/A</tr>\n";
    for (const ComparedFigure& f : c.figures) {
        fmt::format_to(out, "<tr><td>{}", html(f.name));
        cells(f, 1);
        body += "</tr>\n";
    }
    return report_page("Latency of two runs", body + "</table>\n");
}

}  // namespace app
