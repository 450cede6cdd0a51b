#pragma once
#include <memory>
#include <vector>

#include "struck/body_model.h"
#include "struck/body_motion.h"

namespace sim {

/// What one body contributes to a StepReply.
struct BodyOutcome {
    struct PathContact {
        std::uint32_t path;  ///< place in StepRequest::paths
        Contact contact;
    };
    std::uint32_t body = 0;
    ModalState state;
    std::vector<ModalState> pictures;   ///< one per request
    std::vector<double> clearance_m;    ///< one per path
    std::vector<PathContact> contacts;  ///< by path, then time
};

/// The exact state of a body after its last step: all that must travel for it to go on elsewhere with the
/// same bits.
struct BodyRecord {
    ModalState state;
    bool stepped = false;  ///< false: at rest, before its first step
    double t_s = 0;        ///< of the last step
};

/// One body, stepped. The same code runs in the application and in workers; each body depends on nothing but
/// its own record and the request, so the reply does not depend on who steps which body.
class SteppedBody {
public:
    SteppedBody(std::uint32_t index, const BodyDefinition& definition, const BodyRecord& record = {});

    /// Steps and fills `outcome`, reusing its memory. Ignores impulses on other bodies.
    void step(const StepRequest& request, BodyOutcome& outcome);
    [[nodiscard]] std::uint32_t index() const noexcept { return index_; }
    [[nodiscard]] const BodyRecord& record() const noexcept { return record_; }  ///< after the last step

private:
    [[nodiscard]] OscillatorState folded(const StepRequest& request) const;
    [[nodiscard]] ModalState picture(const PictureRequest& request, const OscillatorState& now) const;
    void set_motion(const StepRequest& request, const OscillatorState& now);
    void sweep(const StepRequest& request, BodyOutcome& outcome);

    std::uint32_t index_;
    std::unique_ptr<const BodyModel> model_;  ///< on the heap: motion_ points to it when the body is moved
    BodyMotion motion_;
    BodyRecord record_;
    std::vector<const Impulse*> confirmed_;
    std::vector<Contact> found_;
};

/// The reply of outcomes given in order of body.
[[nodiscard]] StepReply merge(const std::vector<BodyOutcome>& outcomes, const StepRequest& request);

}  // namespace sim
