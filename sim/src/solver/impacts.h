#pragma once
#include <vector>

#include "solver/applied_forces.h"
#include "solver/island_rows.h"

namespace sim {

/// Impacts come first in a substep, in the order of their times: those of fast pairs (ManifoldPoint::begins), and contacts of
/// rigid bodies that rebound and close their gap within the substep. Bodies go to that time with the velocities that they have,
/// frames with them, and on from there.
///
/// An impact is shared out as generalized reflections are (Smith, Kaufman, Vouga, Tamstorf, Grinspun 2012, "Reflections on
/// simultaneous impact"): of all that touches there, what approaches at v gets impulses P that leave v+ = -e v together (P >= 0,
/// v+ + e v >= 0, no P where more), and so on for what then approaches, until nothing does. A row of balls so hands an impulse
/// on, a box lands on its corners at once. With y the velocities before and d what P adds to them, the energy given is
///   y . d + |d_rigid|^2 / 2 + |d_modes|^2 (held over the substep).
/// Without friction P is scaled to what the rebounds demand, - sum of P v (1 - e) / 2; with friction, which may bring more
/// (Kane), to nothing given at most: no impact gives energy, and none of e = 1 without friction takes any. Afterwards an impact
/// is a contact, unless its bodies turn on too fast for one that stands still.
class Impacts {
public:
    Impacts(IslandRows& rows, AppliedForces& forces) : rows_(rows), forces_(forces) {}
    Impacts(const Impacts&) = delete;
    Impacts& operator=(const Impacts&) = delete;

    void begin();   ///< of an island, or after its contacts were found again
    void strike();  ///< the substep's impacts in their order, then those that they lead to
    /// Directly, where joints want every body at the same time, impacts of rigid bodies that rebound act when the substep
    /// begins; what does not rebound is stopped by its contact. False: one comes so late that the substep has to be halved first.
    [[nodiscard]] bool strike_at_start();
    /// Gaps of bodies that impacts took on close in what is left of the substep.
    void stretch_gap(ContactRows& contact) const;

private:
    /// A contact that meets, at a time of the substep [s].
    struct Hit {
        double time;
        std::size_t contact;
    };
    bool find_hits();
    [[nodiscard]] bool is_elsewhere(const ContactRows& contact, double time) const;
    void list_contacts();
    [[nodiscard]] double meets_at(const ContactRows& contact) const;
    void strike(const Hit& hit);
    void reach(int body, double time);
    bool gather(const Manifold& seed, double time, float least);
    [[nodiscard]] bool touches(const ContactRows& contact, const Manifold& seed, double time) const;
    [[nodiscard]] double gap_at(const ContactRows& contact, double time) const;
    void reflect();
    void hold_springs();
    void sweep_impact(bool friction);
    [[nodiscard]] double share_of_impact() const;
    void go_to(BodyRows& body, double time);
    void load_rigid(BodyRows& body, double gone);
    [[nodiscard]] float rounding(const ContactRows& contact) const;
    [[nodiscard]] bool goes_far(const ContactRows& contact) const;
    void end_impact(ContactRows& contact);

    IslandRows& rows_;
    AppliedForces& forces_;
    std::vector<Hit> hits_;                                 // of the substep, by time
    std::vector<int> hit_bodies_;                           // of the impact that is being solved
    std::vector<std::size_t> striking_, struck_;            // contacts, now and since it began
    std::vector<std::size_t> holding_;                      // springs
    std::vector<std::size_t> contacts_of_, first_contact_;  // body by body, and where each begins
    std::vector<int> next_of_;                              // per body, list_contacts
};

}  // namespace sim
