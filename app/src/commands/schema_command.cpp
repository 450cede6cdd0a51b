#include <fmt/format.h>

#include <memory>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/format_description.h"
#include "kit/kit.h"
#include "scene/scene.h"
#include "traces/map_file.h"

namespace app {

void add_schema_command(Command& program) {
    Command command = program.command(
        "schema", "Print what a kit, scene or map may hold: every key with its range, unit and default");
    auto format = std::make_shared<std::string>();
    auto markdown = std::make_shared<bool>(false);
    command.required("FORMAT", *format, as::choice({"kit", "scene", "map"}), "kit, scene or map");
    command.flag("--markdown", *markdown, "The reference page instead of a JSON Schema");
    command.runs([format, markdown] {
        const FormatDescription description = *format == "kit"     ? kit_format()
                                              : *format == "scene" ? scene_format()
                                                                   : map_format();
        fmt::print("{}", *markdown ? reference_page(description,
                                                    fmt::format("musicworld schema {} --markdown", *format))
                                   : json_schema(description));
    });
}

}  // namespace app
