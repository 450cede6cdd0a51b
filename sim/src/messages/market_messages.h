#pragma once
#include <stdexcept>
#include <vector>

#include "bytes/fields.h"
#include "messages/world_record_codec.h"

namespace sim {

// Messages by which bodies change owners, see worker_messages.h.

constexpr double kLongestTime_s = 1e9;  ///< that a message may state

/// Of bodies, to balance the load.
struct Offer {
    static constexpr const char* kRoute = "worker to worker";
    std::uint32_t to = 0, number = 0;  ///< number: of the seller's offers
    std::vector<std::uint32_t> bodies;
    std::vector<float> cost_s;  ///< of each, at the seller
    bool gathers = false;       ///< as the application asked, see Gather: whatever it costs
};
struct OfferedBody {  ///< as it travels
    std::uint32_t body = 0;
    float cost_s = 0;
};
void fields(auto& archive, Is<OfferedBody> auto& o) {
    archive("body cost_s", Within{o.body, 0, kMostWorldBodies - 1}, Within{o.cost_s, 0, kLongestTime_s});
}
template <typename Archive>
void fields(Archive& archive, Is<Offer> auto& m) {
    std::vector<OfferedBody> offered;
    if constexpr (Archive::kWrites) {
        if (m.bodies.size() != m.cost_s.size()) throw std::invalid_argument("an offer without all costs");
        for (std::size_t i = 0; i < m.bodies.size(); ++i) offered.push_back({m.bodies[i], m.cost_s[i]});
    }
    archive("to number gathers bodies", m.to, m.number, m.gathers, offered);
    if constexpr (Archive::kReads) {
        m.bodies.clear(), m.cost_s.clear();
        for (const OfferedBody& o : offered) m.bodies.push_back(o.body), m.cost_s.push_back(o.cost_s);
    }
}

struct OfferAnswer {
    static constexpr const char* kRoute = "worker to worker";
    std::uint32_t to = 0, number = 0;
    bool accepted = false;
};
void fields(auto& archive, Is<OfferAnswer> auto& m) {
    archive("to number accepted", m.to, m.number, m.accepted);
}

/// The application registers it or gives the bodies back: exact states at the end of the header's step.
struct Handover {
    static constexpr const char* kRoute = "worker to application";
    std::uint32_t to = 0, number = 0;
    std::vector<WorldRecord> bodies;
};
void fields(auto& archive, Is<Handover> auto& m) {
    archive("to number bodies", m.to, m.number, m.bodies);
}

/// From the application: these bodies belong to a structure (shared/structures.h) of which another worker has
/// most, or their owner leaves: it offers them to `to`. `to` kApplication: nobody else stays, so it hands over
/// what it has.
struct Gather {
    static constexpr const char* kRoute = "application to one worker";
    std::uint32_t to = 0;
    std::vector<std::uint32_t> bodies;
};
void fields(auto& archive, Is<Gather> auto& m) {
    archive("to bodies", m.to, m.bodies);
}

}  // namespace sim
