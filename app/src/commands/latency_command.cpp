#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <memory>

#include "commands/play_command.h"
#include "files/bad_input.h"
#include "files/output_folder.h"
#include "latency/latency_comparison.h"
#include "latency/latency_report.h"
#include "process/stop_signals.h"

namespace app {
namespace fs = std::filesystem;
namespace {

struct LatencyOptions : RealtimeOptions {
    std::vector<std::string> compare;
    bool json = false, realtime = false;
};

/// A new folder among the temporary ones.
fs::path make_folder() {
    std::string name = (fs::temp_directory_path() / "musicworld_latency_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr)
        throw std::runtime_error(fmt::format(
            "{}: error: found no way to make a folder there, expected one for the run; use --out DIR",
            fs::temp_directory_path().string()));
    return name;
}

void compare(const LatencyOptions& o) {
    const LatencyComparison comparison = compare_latency(o.compare[0], o.compare[1]);
    if (!o.play.out.empty()) {
        static constexpr std::array<std::string_view, 2> kProducts = {"comparison.json", "report.html"};
        OutputFolder out(o.play.out, kProducts);
        write_file(out.path("comparison.json"), format_json(comparison));
        write_file(out.path("report.html"), format_page(comparison));
        out.finish();
    }
    fmt::print("{}", o.json ? format_json(comparison) : format_text(comparison));
}

void measure(const LatencyOptions& o, const RunInTime& run) {
    const bool kept = !o.play.out.empty();
    const StopSignals signals;  // until the temporary folder is gone
    RealtimeOptions options = o;
    if (!kept) options.play.out = make_folder();
    const auto remove = [kept](const fs::path* folder) {
        std::error_code ignored;
        if (!kept) fs::remove_all(*folder, ignored);
    };
    const std::unique_ptr<const fs::path, decltype(remove)> at_end(&options.play.out, remove);
    const RealtimeOutcome outcome = run(options);
    fmt::print("{}", o.json ? format_latency_json(outcome.latency, outcome.play, outcome.realtime)
                            : format_latency_text(outcome.latency, outcome.realtime));
    if (kept && !o.json) fmt::print("Look at {}\n", (options.play.out / "latency.html").string());
    if (!outcome.failure.empty()) throw std::runtime_error(outcome.failure);
    if (kept) throw_if_any(outcome.play.failures, options.play.out);
}

}  // namespace

void add_latency_command(Command& program, const RunInTime& run) {
    Command command = program.command(
        "latency",
        "Play in real time and measure: each stage's latency, deadlines missed, sound against picture, leads "
        "needed");
    auto o = std::make_shared<LatencyOptions>();
    o->play.out.clear();
    add_realtime_options(command, *o, add_play_options(command, o->play));
    command.flag("--no-frames", o->play.frames, "Draw nothing", false);
    command.flag("--json", o->json, "Print one JSON document");
    command.option("--out", o->play.out, as::text("DIR"),
                   "Folder for what play writes, latency.json, latency.html and the rows as CSV");
    command.options(
        "--compare", o->compare, as::text("DIR"),
        "Two such folders of earlier runs: their figures side by side (--out: comparison.json, report.html)");
    command.flag("--realtime", o->realtime, "Always so")->group("");
    command.checks([o] {
        if (o->realtime) refuse_options("--realtime", "none: latency always plays in real time");
        if (const std::size_t folders = o->compare.size(); folders != 0 && folders != 2)
            refuse_options(counted(folders, "folder") + " after --compare", "two");
    });
    command.runs([o, run] {
        if (o->compare.empty())
            measure(*o, run);
        else
            compare(*o);
    });
}

}  // namespace app
