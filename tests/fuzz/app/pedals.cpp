// Schedules of pedals.
#include "play/pedals.h"

#include "files/assets.h"
#include "files/bad_input.h"
#include "fuzz_target.h"

void fuzz_pedals(std::string_view bytes) {
    static const app::Kit kit = app::read_kit(app::find_kit("drums"));
    try {
        app::Pedals pedals(kit, 0);
        for (const app::PedalMove& move : app::parse_pedals(bytes, "fuzz", kit)) pedals.take(move);
        for (const app::PedalNote& each : pedals.notes())
            require(each.note.onset_sample >= 0 && each.note.speed_mps <= 8.001, "a note that cannot be");
    } catch (const app::BadInput& fault) {
        require_located(fault, "fuzz:");
    }
}
