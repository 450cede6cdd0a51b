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
/// What two steps in a row have in common: component by component the smaller, none where signs differ.
/// Weight that lasts stays, a knock does not. Displacement and turn are none.
void lasting(const StepImpulse& a, const StepImpulse& b, StepImpulse& out);

/// What bodies were given by bodies of each worker, step by step: pushes, known up to some step of each
/// worker, assumed beyond it. Step s is the one that ends with s steps done. Everybody who knows the same
/// pushes assumes the same, so nobody has to tell what he assumed.
class ImpulseLog {
public:
    /// The world tells what modes a push came to.
    ImpulseLog(const World& world, int bodies, int keep_steps);

    static constexpr std::uint64_t kForever = ~std::uint64_t{0};
    void add(int body, std::uint32_t source, std::uint64_t step, StepImpulse impulse);
    /// The pushes of a message, read when they are asked for.
    void add(std::uint32_t source, std::uint64_t step, const std::shared_ptr<const PackedUpdates>& message);
    /// All of the source's pushes up to `step` are in; kForever: it has gone.
    void heard(std::uint32_t source, std::uint64_t step);
    [[nodiscard]] std::uint64_t known(std::uint32_t source) const;
    [[nodiscard]] const std::map<std::uint32_t, std::uint64_t>& sources() const noexcept { return known_; }

    /// Sources that pushed the body lately, at most kMostSources (more are left out), ascending.
    static constexpr int kMostSources = 64;
    struct Sources {
        std::uint32_t source[kMostSources];
        int count = 0;
        [[nodiscard]] const std::uint32_t* begin() const noexcept { return source; }
        [[nodiscard]] const std::uint32_t* end() const noexcept { return source + count; }
    };
    [[nodiscard]] Sources sources_of(int body, std::uint64_t since = 0) const;
    /// How many of them since `step`, `self` apart.
    [[nodiscard]] int count_since(int body, std::uint64_t step, std::uint32_t self) const;
    [[nodiscard]] bool quiet(int body) const { return entries_[static_cast<std::size_t>(body)].empty(); }
    /// Push in step `step` to who knows those up to `known`: as it was, or as assumed (in `scratch`);
    /// nullptr: none.
    [[nodiscard]] const StepImpulse* seen(int body, std::uint32_t source, std::uint64_t step,
                                          std::uint64_t known, StepImpulse& scratch) const;
    /// First step after `step` with a push on the body; kForever: none.
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
