#include <fmt/format.h>
#include <tracking/trace.h>

#include <algorithm>
#include <memory>
#include <string>

#include "commands/command.h"
#include "commands/commands.h"
#include "commands/sensor_model_options.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "process/clock.h"
#include "sticks/learned_in_play.h"
#include "sticks/predictors.h"
#include "traces/live_predict.h"
#include "traces/predict.h"
#include "traces/sensor_model.h"

namespace app {
namespace {

struct PredictOptions {
    std::string trace, out, send;
    std::optional<std::filesystem::path> save_model;
    LivePredictOptions live;
    tracking::SensorModel sensor;
};

void print_to_errors(const LivePredictResult& r) {
    fmt::print(stderr,
               "{}, from sample to answer {:.0f} us in the median, {:.0f} us at p99, {:.0f} us at most\n",
               counted(r.answers, "answer"), 1e6 * r.p50_s, 1e6 * r.p99_s, 1e6 * r.most_s);
    if (r.unsent > 0) fmt::print(stderr, "{} could not be sent\n", counted(r.unsent, "answer"));
    if (r.left_out > 0)
        fmt::print(stderr, "{} left out, before an older one of their stick\n",
                   counted(r.left_out, "sample"));
    if (r.faults.malformed > 0)
        fmt::print(stderr, "{} left out, the first: {}\n", counted(r.faults.malformed, "message"),
                   r.faults.first);
    if (r.faults.foreign + r.faults.lost > 0)
        fmt::print(stderr, "{} of other sticks, {} lost for lack of time\n",
                   counted(r.faults.foreign, "sample"), r.faults.lost);
}

void predict_file(const PredictOptions& o) {
    const std::string file = find_trace(o.trace).string();
    const std::filesystem::path inputs[] = {file};
    refuse_replacing(o.out, inputs);
    if (o.save_model) refuse_replacing(*o.save_model, inputs);
    std::optional<LearnedModel> model;
    if (o.save_model)
        model.emplace(LearnedInPlay{*o.save_model, "predict", picture_specification(o.live.predictor), file});
    std::vector<tracking::Experience> learned;
    const std::string table = predict_table(seen_by(tracking::read_trace(file), o.sensor), o.live.predictor,
                                            o.live.leads_s.front(), &learned);
    if (o.out.empty())
        fmt::print("{}", table);
    else
        write_finished_file(o.out, table);
    if (model) model->save(learned);
}

/// What there may be of the options besides --predictor and --lead.
void check(const PredictOptions& o, const std::vector<std::string>& given, bool stream) {
    const bool live = !o.live.source.source.empty();
    if (live == !o.trace.empty())
        refuse_options(live ? "TRACE with --source" : "no TRACE", "TRACE, - or --source");
    if (live == o.send.empty())
        refuse_options(live ? "--source without --send" : "--send without --source", "both");
    if (!live && o.live.leads_s.size() > 1)
        refuse_options(fmt::format("{} leads", o.live.leads_s.size()), "one: several are for --send");
    const std::vector<std::string> of_live = {"--kit",     "--tip",    "--shaft",
                                              "--seconds", "--sticks", "--speed"};
    for (const std::string& word : given) {
        const std::string name = word.substr(0, word.find('='));
        if (!name.starts_with("--")) continue;
        const bool for_live = std::ranges::count(of_live, name) > 0;
        if (for_live != live || stream)
            refuse_options(name + (live     ? " with --source"
                                   : stream ? " with -"
                                            : " without --source"),
                           for_live ? "it with --source alone" : "it with the file of a trace alone");
    }
}

void predict(PredictOptions o, const std::vector<std::string>& given) {
    const bool stream = o.trace == "-";
    check(o, given, stream);
    if (stream) {
        o.live.source.source = "stdin";
        const std::unique_ptr<PredictionSink> rows = make_row_sink();
        const LivePredictResult result = predict_live(o.live, *rows);
        if (result.answers == 0) fmt::print("{}", predicted_row_header());  // a table without rows
        if (result.faults.malformed > 0 || result.left_out > 0) print_to_errors(result);
    } else if (!o.live.source.source.empty()) {
        o.live.source.epoch_ns = monotonic_ns() + kHeadStartNs;
        const std::unique_ptr<PredictionSink> sink = open_prediction_sink(o.send);
        print_to_errors(predict_live(o.live, *sink));
    } else {
        predict_file(o);
    }
}

}  // namespace

void add_predict_command(Command& program) {
    Command command = program.command("predict", "Say where a predictor expects the tracked points");
    auto o = std::make_shared<PredictOptions>();
    command.option("TRACE", o->trace, as::text("TRACE"),
                   "Trace (CSV); -: its rows on standard input, as they come");
    command.required("--predictor", o->live.predictor, as::text("PREDICTOR", check_specification),
                     "Predictor; auto: the pictures'");
    command.required("--lead", o->live.leads_s, as::list_of(as::number(0, 1, "s")),
                     "Time ahead of each sample; with --send also several, separated by commas");
    command.option("--out", o->out, as::text("FILE"), "File to write (CSV); standard output if left out");
    command.option("--save-model", o->save_model, as::text("FILE"),
                   "File for the network of the predictor as the sticks have taught it");
    Command live = command.under("Live sticks");
    live.option("--source", o->live.source.source, as::text("SOURCE"),
                "In place of TRACE, as they come: osc:PORT, zmq:ENDPOINT, stdin or trace:FILE");
    live.option("--send", o->send, as::text("DESTINATION"),
                "Where predictions go: osc:PORT (of this machine), osc:HOST:PORT or zmq:ENDPOINT");
    live.option<std::string>(
        "--kit", as::text("KIT"), "Also send the next strike on a kit: its name or file",
        [o = o.get()](const std::string& name) { o->live.kit = read_kit(find_kit(name)); });
    live.option("--tip", o->live.tip, as::vector_of_3(as::number(-1000, 1000, "m")),
                "Tip in the tracked body's frame");
    live.option("--shaft", o->live.shaft, as::axis(), "Body axis from hand to tip");
    live.option("--sticks", o->live.source.sticks, as::list_of(as::text("NAME")),
                "Names; default: all that come");
    live.option("--seconds", o->live.seconds, as::number(0, as::kAny, "s"),
                "From the first sample on; 0: until the source ends, Ctrl-C or SIGTERM");
    live.option("--speed", o->live.source.speed, as::number_above(0, as::kAny), "Of a replay, for tests")
        ->group("");
    add_sensor_model_options(command, o->sensor);
    command.runs([o, command] {
        predict(*o, command.given_but({"--predictor", "--lead", "--source", "--send"}));
    });
}

}  // namespace app
