#include "play/tables.h"

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>

#include "report/table.h"

namespace app {
namespace {

std::string_view outcome_word(const Strike& strike) {
    switch (strike.outcome) {
        case Outcome::released:
            return "released";
        case Outcome::cancelled:
            return "cancelled";
        case Outcome::pending:
            break;
    }
    throw std::logic_error(
        fmt::format("strike {} of a finished run is neither released nor cancelled", strike.id));
}

}  // namespace

std::string format_events(const PlayResult& result) {
    Table table = Table::of({"id", "stick", "instrument", "onset_s", "speed_mps", "px", "py", "pz",
                             "scheduled_at_s", "outcome", "moves", "decided_at_s", "model"});
    // Of several models in parallel, the number of the one that the note's time comes from.
    const auto model = [&](const Strike& s) {
        return result.sound_models > 1 ? fmt::format("{}#{}", result.sound_predictor, s.model)
                                       : result.sound_predictor;
    };
    for (const Strike& s : result.strikes)
        table.add({s.id, result.sticks.at(s.stick), result.instruments.at(s.instrument), s.onset_s,
                   s.speed_mps, s.point_world.x(), s.point_world.y(), s.point_world.z(), s.scheduled_at_s,
                   outcome_word(s), s.moves, s.decided_at_s, model(s)});
    return table.csv();
}

std::string format_contacts(const PlayResult& result) {
    Table table = Table::of({"t", "stick", "instrument", "speed_mps", "px", "py", "pz", "matched_id"});
    for (const TrueContact& c : result.contacts)
        table.add({c.t_s, result.sticks.at(c.stick), result.instruments.at(c.instrument), c.speed_mps,
                   c.point_world.x(), c.point_world.y(), c.point_world.z(), c.matched_id});
    return table.csv();
}

}  // namespace app
