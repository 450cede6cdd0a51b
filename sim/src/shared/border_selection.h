#pragma once
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "shared/nearness.h"

namespace sim {

/// Selects the own bodies whose states one worker sends to each other worker: those that may come near that
/// worker's bodies, as far as it is known where these are. A body that is not sent is far away. The state of
/// a sleeping body is sent once to each worker that it is near to, and again when it wakes. If a worker may
/// hold a wrong state of a body, its state is sent wherever it is.
class BorderSelection {
public:
    /// `bodies`: their number, with those that are added later. `size`: their mean diameter [m].
    BorderSelection(std::size_t bodies, int bound, const WorldSettings& settings, double size);

    // The other workers.
    void add(std::uint32_t worker) { neighbours_[worker].sent.assign(bodies_, Sent::unknown); }
    void remove(std::uint32_t worker) { neighbours_.erase(worker); }
    [[nodiscard]] bool has(std::uint32_t worker) const { return neighbours_.contains(worker); }
    template <typename Visit>
    void for_each(Visit visit) const {
        for (const auto& [worker, neighbour] : neighbours_) visit(worker);
    }
    /// Where a worker's bodies were at its step and where they go. It knew the owners of this epoch when it
    /// wrote that.
    void set_reach(std::uint32_t worker, std::uint64_t step, const Reach& reach, std::uint32_t epoch);
    /// A worker got these bodies in this epoch. Its reach will contain them later.
    void add_gained(std::uint32_t worker, const std::vector<WorldRecord>& bodies, std::uint32_t epoch);
    void invalidate(int body);  ///< any worker may hold a wrong state of this body

    // Own bodies, after each step.
    void begin_step() { own_.clear(), ways_.clear(); }
    void add_own(int body, const WorldBodyState& state, double radius, bool asleep, bool flat);
    /// The reach of own bodies and of `future` ones, which are own from a later step on.
    [[nodiscard]] Reach reach(const std::vector<WorldRecord>& future) const;
    /// The bodies to send to a worker now, by their order in add_own. They count as sent.
    [[nodiscard]] std::span<const std::size_t> select(std::uint32_t worker, std::uint64_t step);

private:
    /// The state of an own body that a worker received last.
    enum class Sent : std::uint8_t { awake, asleep, unknown };
    struct Neighbour {
        std::vector<Sent> sent;          // by body
        Reach reach;                     // of its bodies ...
        std::uint64_t step = 0;          // ... at this step
        std::vector<Reach> gained;       // bodies that `reach` lacks ...
        std::uint32_t gained_epoch = 0;  // ... and the epoch of the last ones
    };
    struct OwnBody {
        int body;
        bool asleep, flat;
    };
    struct Margin {
        double radius;
        Outlook outlook;
    };
    [[nodiscard]] Margin margin_of_gained() const;
    [[nodiscard]] bool is_near(std::size_t which, const Reach& reach, double age) const;

    std::size_t bodies_;
    double dt_, size_;
    Eigen::Vector3f up_;
    Outlook outlook_, outlook_of_flat_;
    std::map<std::uint32_t, Neighbour> neighbours_;
    std::vector<OwnBody> own_;
    std::vector<std::pair<Eigen::AlignedBox3f, float>>
        ways_;  // of these, with speeds; of a broken body empty
    std::vector<std::size_t> selected_;
};

}  // namespace sim
