#include <fmt/format.h>
#include <tracking/trace.h>

#include <memory>
#include <string>

#include "commands/command.h"
#include "commands/commands.h"
#include "commands/sensor_model_options.h"
#include "files/assets.h"
#include "files/output_folder.h"
#include "sticks/predictors.h"
#include "traces/predict.h"
#include "traces/sensor_model.h"

namespace app {
namespace {

struct PredictOptions {
    std::string trace, predictor, out;
    double lead_s = 0;
    tracking::SensorModel sensor;
};

void predict(const PredictOptions& o) {
    const std::string table =
        predict_table(seen_by(tracking::read_trace(find_trace(o.trace)), o.sensor), o.predictor, o.lead_s);
    if (o.out.empty())
        fmt::print("{}", table);
    else
        write_finished_file(o.out, table);
}

}  // namespace

void add_predict_command(Command& program) {
    Command command = program.command("predict", "Write down where a predictor expects the tracked points");
    auto o = std::make_shared<PredictOptions>();
    command.required("TRACE", o->trace, as::text("TRACE"), "Trace (CSV)");
    command.required("--predictor", o->predictor, as::text("PREDICTOR", check_specification),
                     "Predictor; auto: the pictures'");
    command.required("--lead", o->lead_s, as::number(0, 1, "s"), "Time ahead of each sample");
    command.option("--out", o->out, as::text("FILE"), "File to write (CSV); standard output if left out");
    add_sensor_model_options(command, o->sensor);
    command.runs([o] { predict(*o); });
}

}  // namespace app
