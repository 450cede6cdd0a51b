#include "latency_command.h"

#include <fmt/format.h>

#include <memory>
#include <optional>

#include "bad_input.h"
#include "latency_comparison.h"
#include "latency_products.h"
#include "latency_tables.h"
#include "numbers.h"

namespace app {
namespace {

constexpr double kShortestS = 1, kLongestS = 86400;

/// The options as typed.
struct Typed {
    LatencyArguments run;
    std::string seconds = "60", out;
    std::vector<std::string> compare;
    bool json = false;
};

void compare(const Typed& typed) {
    const LatencyComparison comparison = compare_latency(typed.compare[0], typed.compare[1]);
    if (!typed.out.empty()) {
        static constexpr std::array<std::string_view, 2> kProducts = {"comparison.json", "report.html"};
        OutputFolder out(typed.out, kProducts);
        write_file(out.path("comparison.json"), format_json(comparison));
        write_file(out.path("report.html"), format_page(comparison));
        out.finish();
    }
    fmt::print("{}", typed.json ? format_json(comparison) : format_text(comparison));
}

double seconds_of(const Typed& typed) {
    const double seconds = parse_number(typed.seconds, "--seconds");
    if (!(seconds >= kShortestS && seconds <= kLongestS))
        throw BadInput(fmt::format("error: found --seconds {}, expected {} to {}", typed.seconds, kShortestS,
                                   kLongestS));
    return seconds;
}

void measure(Typed typed, const MeasureRun& run) {
    typed.run.seconds = seconds_of(typed);
    std::optional<OutputFolder> out;
    if (!typed.out.empty()) out.emplace(typed.out, latency_products());
    const MeasuredRun r = run(typed.run);
    const LatencyReport report = latency_report(r.play, r.realtime, r.kit, r.geometry);
    if (out) {
        write_latency_products(*out, report, r.play, r.realtime);
        out->finish();
    }
    fmt::print("{}", typed.json ? format_latency_json(report, r.play, r.realtime)
                                : format_latency_text(report, r.realtime));
}

}  // namespace

void add_latency_command(CLI::App& program, const MeasureRun& run) {
    CLI::App* command = program.add_subcommand(
        "latency",
        "Play a trace in real time and measure: each stage's latency, deadlines missed, leads needed");
    auto typed = std::make_shared<Typed>();
    command->add_option("TRACE", typed->run.trace, "Trace (CSV), or the name of a bundled one")
        ->capture_default_str();
    command->add_option("--kit", typed->run.kit, "Kit: its name or file")->capture_default_str();
    command->add_option("--seconds", typed->seconds, "How long; a shorter trace loops")
        ->capture_default_str();
    command->add_flag("--json", typed->json, "Print one JSON document");
    command->add_option("--out", typed->out, "Folder for latency.json, the rows as CSV, report.html");
    command
        ->add_option("--compare", typed->compare, "Two folders of earlier runs: their figures side by side")
        ->expected(2);
    command->callback([typed, run] {
        if (typed->compare.empty())
            measure(*typed, run);
        else
            compare(*typed);
    });
}

}  // namespace app
