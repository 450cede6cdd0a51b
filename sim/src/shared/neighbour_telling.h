#pragma once
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "shared/nearness.h"

namespace sim {

/// Of which of its bodies one worker tells each other one: of those that may come near that one's, as far as it knows
/// where these are. What it does not name is far away. What sleeps is told once to each, when it is near, and once more when it wakes;
/// what another one may believe wrongly is told wherever it is.
class NeighbourTelling {
public:
    /// bodies: number, with later ones. size: their mean diameter [m].
    NeighbourTelling(std::size_t bodies, int bound, const WorldSettings& settings, double size);

    // The other workers.
    void add(std::uint32_t worker);
    void remove(std::uint32_t worker) { listeners_.erase(worker); }
    [[nodiscard]] bool has(std::uint32_t worker) const { return listeners_.contains(worker); }
    template <typename Visit>
    void each(Visit visit) const {
        for (const auto& [worker, listener] : listeners_) visit(worker);
    }
    /// Where its bodies were and went at its step, of which it wrote when it knew owners up to this epoch.
    void heard(std::uint32_t worker, std::uint64_t step, const Reach& reach, std::uint32_t epoch);
    /// It got these bodies in this epoch, and has told nothing of them. What is near them the application may have told it.
    void got(std::uint32_t worker, const std::vector<WorldRecord>& bodies, std::uint32_t epoch);
    void doubt_body(int body);  ///< all may believe anything of this body

    // Own bodies, after each step.
    void begin() { moving_.clear(), ways_.clear(); }
    void see(int body, const WorldBodyState& state, double radius, bool asleep, bool flat);
    /// coming: bodies that will be own in later steps.
    [[nodiscard]] Reach reach(const std::vector<WorldRecord>& coming) const;
    /// To be told now: places in the order of see. They count as told.
    [[nodiscard]] std::span<const std::size_t> choose(std::uint32_t worker, std::uint64_t step);

private:
    enum class Believes : std::uint8_t { awake, asleep, anything };
    struct Listener {
        std::vector<Believes> believes;  // of each own body
        Reach reach;                     // where its bodies were ...
        std::uint64_t step = 0;          // ... at this step
        std::vector<Reach> coming;       // bodies that it got ...
        std::uint32_t coming_epoch = 0;  // ... up to here, and of which it has told nothing
    };
    struct Moving {
        int body;
        bool asleep, flat;
    };
    struct Further {
        double radius;
        Outlook outlook;
    };
    [[nodiscard]] Further further() const;
    [[nodiscard]] bool is_near(std::size_t which, const Reach& reach, double age) const;

    std::size_t bodies_;
    double dt_, size_;
    Eigen::Vector3f up_;
    Outlook outlook_, outlook_of_flat_;
    std::map<std::uint32_t, Listener> listeners_;
    std::vector<Moving> moving_;
    std::vector<std::pair<Eigen::AlignedBox3f, float>> ways_;  // of these, empty if it is broken; speeds
    std::vector<std::size_t> chosen_;
};

}  // namespace sim
