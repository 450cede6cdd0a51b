#include <fmt/format.h>

#include <memory>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/format_description.h"
#include "kit/kit_keys.h"
#include "scene/scene_keys.h"
#include "traces/map_file.h"

namespace app {
namespace {

FormatDescription format_called(const std::string& name) {
    return name == "kit" ? kit_format() : name == "scene" ? scene_format() : map_format();
}

struct SchemaOptions {
    std::string format;
    bool markdown = false;
};

}  // namespace

void add_schema_command(Command& program) {
    Command command = program.command(
        "schema", "Print what a kit, scene or map may hold: every key with its range, unit and default");
    auto o = std::make_shared<SchemaOptions>();
    command.option("FORMAT", o->format, as::choice({"kit", "scene", "map"}), "Of which file").required();
    command.flag("--markdown", o->markdown, "The reference page instead of a JSON Schema");
    command.runs([o] {
        const FormatDescription description = format_called(o->format);
        fmt::print(
            "{}", o->markdown
                      ? reference_page(description, fmt::format("musicworld schema {} --markdown", o->format))
                      : json_schema(description));
    });
}

}  // namespace app
