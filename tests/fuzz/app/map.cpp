// Maps of columns and experiments (TOML); the first byte says which.
#include "compare/experiment.h"
#include "files/bad_input.h"
#include "fuzz_target.h"
#include "traces/map_file.h"
#include "tracking/trace.h"
#include "written_input.h"

void fuzz_map(std::string_view bytes) {
    static const WrittenInput input("fuzz.toml");
    if (bytes.empty()) return;
    const bool is_experiment = bytes[0] == 'e';
    const std::filesystem::path& file = input.with(bytes.substr(1));
    try {
        if (is_experiment) return (void)app::read_experiment(file);
        const std::string text = app::format_map(app::read_map(file));
        require(app::format_map(app::read_map(input.with(text))) == text, "a map that reads back to another");
    } catch (const app::BadInput& fault) {
        require_located(fault, "");
    } catch (const tracking::TraceError& fault) {  // an input of an experiment that is not there
        require_located(fault, "");
    }
}
