#include "commands/schema_command.h"

#include <fmt/format.h>

#include <memory>

#include "files/format_description.h"
#include "kit/kit_keys.h"
#include "scene/scene_keys.h"
#include "traces/map_file.h"

namespace app {
namespace {

FormatDescription format_called(const std::string& name) {
    return name == "kit" ? kit_format() : name == "scene" ? scene_format() : map_format();
}

}  // namespace

void add_schema_command(CLI::App& program) {
    CLI::App* command = program.add_subcommand(
        "schema", "Print what a kit, scene or map may hold: every key with its range, unit and default");
    auto format = std::make_shared<std::string>();
    auto markdown = std::make_shared<bool>(false);
    command->add_option("FORMAT", *format, "kit, scene or map")
        ->required()
        ->check(CLI::IsMember({"kit", "scene", "map"}));
    command->add_flag("--markdown", *markdown, "The reference page instead of a JSON Schema");
    command->callback([format, markdown] {
        const FormatDescription description = format_called(*format);
        fmt::print("{}", *markdown ? reference_page(description,
                                                    fmt::format("musicworld schema {} --markdown", *format))
                                   : json_schema(description));
    });
}

}  // namespace app
