#pragma once
#include "contact/step_contacts.h"

namespace sim {

/// Contacts of an island found again within a step: half-spaces that stand still are right only while bodies
/// move little (StepContacts: kSlow), and bodies that are joined or pressed may leave their free paths by far.
///
/// Looked at are the pairs among the island's bodies, their pairs of before with others, and all planes, where
/// they are now, up to kSlow of the smaller half extent apart. Impulses go on as from step to step. Cost:
/// O(n^2) tests of balls, and the narrow phase of pairs that are near. Allocates only while its buffers grow.
class IslandContacts {
public:
    /// ids: the island's bodies, ascending. paths: of all bodies, of which those of prescribed motion are followed.
    /// manifolds: its contacts by ascending keys, replaced; those that begin after `time` [s, since the step's
    /// start] stay as they are.
    void find(const ContactScene& scene, const std::vector<int>& ids, const std::vector<BodyPath>& paths,
              double time, std::vector<Manifold>& manifolds);

private:
    const PosedBody& posed(const ContactScene& scene,
                           int id);  // now; one of a prescribed motion till the next call
    void list_keys(const ContactScene& scene);
    void find_pair(const ContactScene& scene, const Manifold* before, Manifold& manifold);

    NarrowPhase narrow_;
    const std::vector<int>* ids_ = nullptr;
    const std::vector<BodyPath>* paths_ = nullptr;
    double time_ = 0;
    std::vector<PosedBody> posed_;  // of ids_, now
    PosedBody driven_;
    std::vector<std::uint64_t> keys_;
    std::vector<Manifold> before_;
};

}  // namespace sim
