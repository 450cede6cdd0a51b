#pragma once
#include <optional>
#include <span>

#include "tracking/training.h"

namespace tracking {

struct LearnedContacts {
    PathModel::Layers layers;
    std::size_t examples = 0, steps = 0;
    /// Held-out cross entropy, and that of a constant answer: the frequency of each outcome.
    double loss = 0, loss_of_shares = 0;
};

/// Learns when a tip meets a plane: the network of PathModel::contacts.
///
/// Each stick is augmented many times (Sighting), by sensors as in train_path_model, slower and faster (by up
/// to a factor of 1.8), greater and smaller, taller, tilted; each time with planes that are chosen without
/// regard to what comes next: most of them a little above where the tip turns upwards, as instruments stand;
/// some among these turning points, so that strokes turn back before them; the others at any height; a
/// quarter are not level. A contact goes 3 mm deep and begins 3 mm outside. Cross entropy over the 18 bins
/// and none; Adam; the weights that did best on the sticks held out. None where there are too few examples. A
/// pure function of its arguments, one thread.
[[nodiscard]] std::optional<LearnedContacts> train_contacts(std::span<const TrainingStick> sticks,
                                                            const TrainingOptions& options);

}  // namespace tracking
