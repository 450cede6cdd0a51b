#pragma once
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "strikes/strike_scheduler.h"

namespace app {

/// One stick's released strikes, of a predictor with one model or several. Each model has a scheduler of its
/// own; what a scheduler releases is played if its model is selected, unless another model's note has been
/// played for the same stroke: the tip must first rise out of the surface, as the scheduler asks too. A model
/// that is selected after it has released a stroke itself, not being selected then, stands by that stroke:
/// the note of another model for it is played.
class PlayedStrikes {
public:
    PlayedStrikes(const StrikeRules& rules, std::size_t parts, std::size_t models)
        : rules_(rules),
          shut_(parts),
          schedulers_(models, StrikeScheduler(rules, 1, parts)),
          unplayed_s_(models, std::vector<double>(parts, -std::numeric_limits<double>::infinity())) {}

    /// Before the sample at s: what falls due is released by the model selected until now.
    void advance_to(double s);
    void restart();
    /// The contacts of one model's path at the sample at s.
    void sample(std::size_t model, double s, std::span<const sim::Contact> contacts,
                std::span<const double> measured, std::span<const double> filtered);
    /// After the models' contacts: the model selected from here on, and the measured tip's clearances.
    void select(std::size_t model, double s, std::span<const double> measured);
    [[nodiscard]] std::vector<Strike> finish();

private:
    struct Shut {
        std::optional<double> since_s;  ///< onset of the note played
        double lowest = std::numeric_limits<double>::infinity();
    };

    void take_released(std::size_t model);
    void play(const Strike& strike);

    StrikeRules rules_;
    std::vector<Shut> shut_;
    std::vector<StrikeScheduler> schedulers_;
    std::vector<std::vector<double>> unplayed_s_;  // model x part: onset last released while not selected
    std::size_t selected_ = 0;
    std::vector<Strike> played_;
};

}  // namespace app
