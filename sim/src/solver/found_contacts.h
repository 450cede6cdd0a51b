#pragma once
#include "contact/island_contacts.h"
#include "solver/island_rows.h"

namespace sim {

/// Times that a substep is halved at most for bodies that are followed: some 1e-4 of a usual step.
constexpr int kMostFollowLevel = 8;

/// Contacts of an island found again within a step, where its bodies have moved by more than kSlow of their size since they were
/// found: the step goes on as a new one would begin.
class FoundContacts {
public:
    explicit FoundContacts(IslandRows& rows) : rows_(rows) {}
    FoundContacts(const FoundContacts&) = delete;
    FoundContacts& operator=(const FoundContacts&) = delete;

    void note_places();  ///< contacts are those of where bodies are
    [[nodiscard]] bool moved_on()
        const;  ///< bodies have left where contacts were found by so much that these are others
    [[nodiscard]] bool moves_little() const;  ///< in this substep none comes so far
    /// The contacts where the bodies are when the step begins; what was foreseen does not count. Whether there are any.
    bool find_at_start();
    /// The contacts anew, where the bodies are. Whether there are, or were, any.
    bool find_again();
    /// Whether an island in which bodies met unforeseen can be followed: solved directly, in substeps in which none of its bodies
    /// moves by more than kSlow of its size, contacts found again in each. Islands of bodies so small or thin that weight alone
    /// takes one further than that in a step, unless they are too fast, or go on at other workers.
    [[nodiscard]] bool may_follow(const Island& island) const;

private:
    bool take();

    IslandRows& rows_;
    IslandContacts finder_;
};

}  // namespace sim
