#include <fmt/format.h>

#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "commands/command.h"
#include "commands/commands.h"
#include "compare/training_report.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "process/progress_bar.h"
#include "sticks/trace_warnings.h"

namespace app {
namespace {

struct TrainOptions : tracking::TrainingOptions {
    std::vector<std::string> traces;
    std::string out;
};

void train(TrainOptions o) {
    std::vector<std::filesystem::path> inputs;
    for (const std::string& name : o.traces) inputs.push_back(find_trace(name));
    refuse_replacing(o.out, inputs);
    OutputFile out(o.out);  // refused before minutes have passed
    std::vector<Recording> recordings;
    for (const std::string& name : o.traces)
        if (!name.ends_with(".hits.csv") && !name.ends_with(".flags.csv"))
            recordings.push_back(read_recording(find_trace(name).string()));
    if (recordings.empty())
        throw BadInput(
            "error: found no trace among the files, expected at least one recording to learn from");
    require_distinct(recordings);  // one given twice may be both learned from and held out
    const TrainingField field = training_field(recordings);
    auto provenance = [&](const tracking::TrainingResult& result) {
        return provenance_of(recordings, field, o, result, MUSICWORLD_VERSION);
    };
    ProgressBar bar(true);
    o.progress = [&bar](double share) {
        bar.show(share);
        return true;
    };
    try {
        tracking::check_provenance(provenance({}));
        tracking::TrainingResult result = tracking::train_path_model(field.sticks, o);
        bar.clear();
        for (const Recording& recording : recordings) warn_of_units(recording.trace);
        result.model.provenance = provenance(result);
        write_file(out.partial(), tracking::format_path_model(result.model));
        out.finish();
        fmt::print("{}", format_training_text(result, field));
    } catch (const std::invalid_argument& wrong) {
        throw BadInput(fmt::format("error: {}", wrong.what()));
    }
}

}  // namespace

void add_train_command(Command& program) {
    Command command = program.command(
        "train", "Train a network to predict sticks (predictor learned:model=FILE, or auto:model=FILE)");
    auto o = std::make_shared<TrainOptions>();
    command.options("TRACE", o->traces, as::text("TRACE"), "Traces (CSV), or names of bundled ones")
        ->required();
    command.required("--out", o->out, as::text("MODEL"), "File to write");
    command.option("--hidden", o->hidden,
                   as::whole(tracking::PathModel::kLeastHidden, tracking::PathModel::kMostHidden),
                   "Units of each hidden layer: 32 is fast, 64 usual, 128 errs least");
    command.option("--steps", o->steps, as::whole(1, 10000000),
                   "Steps of 256 examples, of each of two trainings");
    command.option("--seed", o->seed, as::whole(0, 1000000000), "Of all that is drawn at random");
    command.flag("--no-contacts", o->contacts, "Learn paths alone: strikes are decided as without a model",
                 false);
    command.runs([o] { train(*o); });
}

}  // namespace app
