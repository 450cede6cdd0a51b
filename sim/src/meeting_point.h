#pragma once
#include <memory>

#include "world_messages.h"

namespace sim {

/// The application's part without clock and sockets: members, the register of owners, passing on, the view of
/// the whole world. All traffic goes through it, so it is one order of events for all: a worker is reachable
/// for everybody or for nobody, and a body has the owner that the register says.
class MeetingPoint {
public:
    MeetingPoint(const WorldScene& scene, const DistributedSettings& settings, DistributedObserver& observer);

    struct Outgoing {
        std::vector<std::uint32_t> to;
        std::shared_ptr<const std::vector<std::uint8_t>> bytes;
    };
    /// Number of the new worker. Queues its scene, then what it has to know.
    std::uint32_t join(const JoinRequest& request);
    void start();  ///< first owners; bodies go to who is there
    /// What a member sent, as it came. Anything that is malformed, not the member's to say, or stale is
    /// counted and dropped.
    void take(std::uint32_t worker, std::span<const std::uint8_t> bytes);
    void lose(std::uint32_t worker,
              const std::string& why);  ///< its bodies go to the others; its messages count no more
    [[nodiscard]] std::vector<Outgoing> outgoing();
    [[nodiscard]] const std::vector<std::uint32_t>& members() const;
    [[nodiscard]] bool finished() const;
    [[nodiscard]] DistributedResult result() const;
};

}  // namespace sim
