#include "compare/experiment.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <set>
#include <sstream>

#include "files/bad_input.h"
#include "files/checksum.h"
#include "files/toml_reader.h"
#include "sticks/predictors.h"

namespace app {
namespace fs = std::filesystem;
namespace {

void input_keys(Fields& keys, InputFile& input) {
    keys.text("file", input.file, "A file that was read.", {.need = Need::here});
    keys.text("sha256", input.sha256, "Of its bytes: the file must be the same. Empty: any.");
}
const TableKind<InputFile> kInputTable = {{"input", "A file that the comparison reads."}, input_keys};

}  // namespace

std::vector<InputFile> inputs_of(const ComparisonOptions& options) {
    std::set<fs::path> files;
    std::error_code none;
    for (const std::vector<std::string>* traces : {&options.traces, &options.tune_traces})
        for (const fs::path trace : *traces) {
            files.insert(trace);
            for (const char* beside : {".hits.csv", ".flags.csv"})
                if (const fs::path marks = fs::path(trace).replace_extension(beside); fs::exists(marks, none))
                    files.insert(marks);
        }
    files.insert(options.surface.kit.files.begin(), options.surface.kit.files.end());
    for (const std::string& predictor : options.predictors)
        if (const std::optional<fs::path> model = model_file(picture_specification(predictor)))
            files.insert(*model);
    for (const auto& [name, file] : options.predictions)
        files.insert(fs::exists(file, none) ? file : file.substr(0, file.rfind('@')));
    std::vector<InputFile> inputs;
    for (const fs::path& file : files) inputs.push_back({file.string(), sha256_of_file(file)});
    return inputs;
}

std::string format_experiment(const Experiment& experiment) {
    toml::array arguments, inputs;
    for (const std::string& argument : experiment.arguments) arguments.push_back(argument);
    for (const auto& [file, sha256] : experiment.inputs)
        inputs.push_back(toml::table{{"file", file}, {"sha256", sha256}});
    const toml::table top{{"version", experiment.version},
                          {"folder", experiment.folder},
                          {"arguments", arguments},
                          {"input", inputs}};
    std::ostringstream text;
    text << "# musicworld compare --experiment FILE --out DIR repeats this comparison.\n" << top << "\n";
    return text.str();
}

Experiment read_experiment(const fs::path& file) {
    Experiment experiment;
    experiment.folder = ".";
    const fs::path own = fs::absolute(file).parent_path();
    read_toml({TomlFile("an experiment", file)}, "the experiment", [&](Fields& keys) {
        keys.text("version", experiment.version, "Of the program that wrote it.");
        keys.text("folder", experiment.folder, "That names of files begin in; relative to this file's own.");
        keys.texts("arguments", experiment.arguments, "Of compare, without --out and --samples.",
                   {.need = Need::given});
        std::error_code error;
        const fs::path folder = own / experiment.folder;
        keys.require(fs::is_directory(folder, error), "folder", "no folder " + folder.string(),
                     "the one that names of files begin in; change it");
        keys.tables("input", InputFile(), kInputTable, "Files that it reads.",
                    [&](Fields& at, InputFile& input) {
                        const std::string now = sha256_of_file(folder / input.file);
                        at.require(input.sha256.empty() || input.sha256 == now, "sha256",
                                   fmt::format("{} with other bytes (SHA-256 {})", input.file, now),
                                   "those that were compared; restore the file, or leave the key out");
                        experiment.inputs.push_back(std::move(input));
                    });
        experiment.folder = folder.string();
    });
    return experiment;
}

}  // namespace app
