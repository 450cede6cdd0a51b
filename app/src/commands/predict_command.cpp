#include "commands/predict_command.h"

#include <fmt/format.h>
#include <tracking/trace.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/finished_file.h"
#include "files/option_values.h"
#include "sticks/predictors.h"
#include "traces/predict.h"
#include "traces/sensor_model_options.h"

namespace app {
namespace {

struct PredictArguments {
    std::string trace, predictor, lead, out;
};

void print(const std::string& text) {
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0)
        throw std::runtime_error(
            fmt::format("error: found that standard output takes no more ({}), expected room for the table",
                        std::strerror(errno)));
}

void predict(const PredictArguments& a, const SensorArguments& sensor) {
    const double lead_s = parse_number(a.lead, "--lead");
    if (!(lead_s >= 0 && lead_s <= 1))
        throw BadInput(fmt::format("error: found --lead {}, expected 0 to 1 s", a.lead));
    check_specification(a.predictor);
    const tracking::SensorModel model = sensor_model(sensor);
    const std::string table =
        predict_table(seen_by(tracking::read_trace(find_trace(a.trace)), model), a.predictor, lead_s);
    if (a.out.empty())
        print(table);
    else
        write_finished_file(a.out, table);
}

}  // namespace

void add_predict_command(CLI::App& program) {
    CLI::App* command =
        program.add_subcommand("predict", "Write down where a predictor expects the tracked points");
    auto a = std::make_shared<PredictArguments>();
    command->add_option("TRACE", a->trace, "Trace (CSV)")->required();
    command->add_option("--predictor", a->predictor, "Predictor; auto: the pictures'")->required();
    command->add_option("--lead", a->lead, "Time ahead of each sample [s]")->required();
    command->add_option("--out", a->out, "File to write (CSV); standard output if left out");
    const std::shared_ptr<SensorArguments> sensor = add_sensor_options(*command);
    command->callback([a, sensor] { predict(*a, *sensor); });
}

}  // namespace app
