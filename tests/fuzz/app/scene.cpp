// Scenes (TOML).
#include "scene/scene.h"

#include "files/bad_input.h"
#include "fuzz_target.h"
#include "written_input.h"

void fuzz_scene(std::string_view bytes) {
    static const WrittenInput input("fuzz.toml");
    try {
        (void)app::read_scene(input.with(bytes));
    } catch (const app::BadInput& fault) {
        require_located(fault, "");
    }
}
