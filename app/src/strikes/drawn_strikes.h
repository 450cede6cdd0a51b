#pragma once
#include <sim/simulation.h>

#include <set>
#include <span>
#include <vector>

#include "strikes/strike.h"

namespace app {

/// The strikes as pictures show them. A contact is drawn, with the impulse known then, by the first frame
/// that is shown after it; if it is cancelled later its response fades within 100 ms, and if it moves before
/// its release the response passes over to the final one in the same time: never a jump. Frames must come in
/// order. One thread.
class DrawnStrikes {
public:
    /// A released strike's impulse has become part of the bodies' exact states.
    void folded(std::uint64_t id) { folded_.insert(id); }
    /// What the frame shown at T adds to the exact states, given the strikes as known from the samples that
    /// this frame may use.
    [[nodiscard]] std::vector<sim::WeightedImpulse> frame(double T, std::span<const Strike> strikes);

private:
    struct Drawn {
        std::uint64_t id;
        sim::Impulse first;  ///< as first drawn
        double first_weight = 1;
        double final_weight = 0;  ///< of the released impulse, where it differs from the first
    };
    void start(double T, std::span<const Strike> strikes);

    std::vector<Drawn> drawn_;
    std::set<std::uint64_t> seen_;  // drawn or settled, until cancelled and faded
    std::set<std::uint64_t> folded_;
    double last_s_ = 0;
    std::size_t first_open_ = 0;  // strikes before it are settled for good
};

/// The impulse of a strike on its body.
[[nodiscard]] sim::Impulse impulse_of(const Strike& strike);

}  // namespace app
