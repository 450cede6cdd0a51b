#pragma once
#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "messages/world_messages.h"

namespace sim {

/// a += factor b; a's modal part grows to b's size.
void add_impulse(StepImpulse& a, const StepImpulse& b, double factor = 1);
/// The same without what the modes came to: for a force that is held.
void add_steady(StepImpulse& a, const StepImpulse& b);
[[nodiscard]] bool is_finite(const StepImpulse& a);
[[nodiscard]] bool is_zero(const StepImpulse& a);
/// The lasting part of two successive steps' impulses: per component the smaller one, 0 if the signs differ.
/// So a resting weight counts and a single blow does not. Displacement and turn are 0.
void lasting(const StepImpulse& a, const StepImpulse& b, StepImpulse& out);

/// Impulses that each worker's bodies gave to bodies, per step: known up to some step of each worker,
/// extrapolated beyond it. Step s is the one that ends with s steps done. Deterministic: workers that know
/// the same impulses extrapolate identically, so extrapolations are not sent.
class ImpulseLog {
public:
    /// `world` computes the modal part of an impulse.
    ImpulseLog(const World& world, int bodies, int keep_steps);

    static constexpr std::uint64_t kForever = ~std::uint64_t{0};
    void add(int body, std::uint32_t source, std::uint64_t step, StepImpulse impulse);  ///< adds one impulse
    /// Adds the impulses of a message; they are decoded when they are needed.
    void add(std::uint32_t source, std::uint64_t step, const std::shared_ptr<const PackedUpdates>& message);
    /// Marks the source's impulses up to `step` as complete; kForever: the source has left.
    void heard(std::uint32_t source, std::uint64_t step);
    [[nodiscard]] std::uint64_t known(std::uint32_t source) const;
    [[nodiscard]] const std::map<std::uint32_t, std::uint64_t>& sources() const noexcept { return known_; }

    /// Workers whose bodies gave the body an impulse lately, at most kMostSources, ascending.
    static constexpr int kMostSources = 64;
    struct Sources {
        std::uint32_t source[kMostSources];
        int count = 0;
        [[nodiscard]] const std::uint32_t* begin() const noexcept { return source; }
        [[nodiscard]] const std::uint32_t* end() const noexcept { return source + count; }
    };
    [[nodiscard]] Sources sources_of(int body, std::uint64_t since = 0) const;
    /// Number of them since `step`, without `self`.
    [[nodiscard]] int count_since(int body, std::uint64_t step, std::uint32_t self) const;
    [[nodiscard]] bool quiet(int body) const { return entries_[static_cast<std::size_t>(body)].empty(); }
    /// The impulse in step `step` for a reader that knows impulses up to `known`: as recorded, or
    /// extrapolated (in `scratch`); nullptr: none.
    [[nodiscard]] const StepImpulse* seen(int body, std::uint32_t source, std::uint64_t step,
                                          std::uint64_t known, StepImpulse& scratch) const;
    /// First step after `step` with an impulse on the body; kForever: none.
    [[nodiscard]] std::uint64_t first_after(int body, std::uint64_t step) const;
    /// `from`, or the first step before `to` that is not forgotten.
    [[nodiscard]] std::uint64_t first_kept(std::uint64_t from, std::uint64_t to) const {
        return to > keep_ ? std::max(from, to - keep_) : from;
    }
    /// Forgets what is older than keep_steps before `step`.
    void prune(std::uint64_t step);

private:
    struct Entry {
        std::uint32_t source, offset;
        std::uint64_t step;
        std::shared_ptr<const PackedUpdates> message;  // until it was read
        std::unique_ptr<StepImpulse> impulse;
    };
    [[nodiscard]] const StepImpulse* find(int body, std::uint32_t source, std::uint64_t step) const;

    const World* world_;
    std::uint64_t keep_;
    mutable std::vector<std::vector<Entry>> entries_;  // by body
    std::map<std::uint32_t, std::uint64_t> known_;
};

}  // namespace sim
