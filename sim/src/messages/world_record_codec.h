#pragma once
#include "bytes/byte_codec.h"
#include "messages/body_fields.h"
#include "sim/world_state.h"

namespace sim {

// Exact states of bodies. Of a broken one the numbers do not travel: zeros stand for them, and w = 1 for the
// orientation; the decoder sets the position to NaN.

constexpr std::uint32_t kMostWorldBodies = 1u << 24;

/// A body's number and its count of modes in four bytes. Throws std::invalid_argument beyond 2^24 or 128.
[[nodiscard]] std::uint32_t body_and_modes(std::uint32_t body, Eigen::Index modes);
struct BodyAndModes {
    std::uint32_t body;
    int modes;
};
[[nodiscard]] BodyAndModes parted(std::uint32_t body_and_modes);  ///< throws DecodeError

/// Whether a state is not finite or beyond 1e7 m or 1e6 m/s; World takes such a body out at the next step.
[[nodiscard]] bool is_broken(const WorldBodyState& state);
/// What travels instead.
[[nodiscard]] WorldBodyState stand_in(Eigen::Index modes);

void fields(auto& archive, Is<WorldBodyState> auto& s) {
    archive("position orientation velocity angular_momentum q q_dot", s.position, s.orientation, s.velocity,
            s.angular_momentum, s.q, s.q_dot);
}

template <typename Archive>
void fields(Archive& archive, Is<WorldRecord> auto& r) {
    std::uint32_t which = 0;
    bool broken = false;
    if constexpr (Archive::kWrites) {
        which = body_and_modes(static_cast<std::uint32_t>(r.body), r.state.q.size());
        broken = is_broken(r.state);
    }
    archive("body_and_modes asleep,quarantined,at_limit,broken still_steps sleep_group", which,
            Bits{r.asleep, r.quarantined, r.at_limit, broken}, r.still_steps, r.sleep_group);
    if constexpr (Archive::kReads) {
        const auto [body, modes] = parted(which);
        r.body = static_cast<int>(body), r.state.q.resize(modes), r.state.q_dot.resize(modes);
    }
    Archive::kWrites&& broken ? archive("state", stand_in(r.state.q.size())) : archive("state", r.state);
    if constexpr (Archive::kReads) {
        archive.check(!is_broken(r.state), "a state that is not finite or out of range");
        if (broken) r.state.position.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
}

// Of all states in a file.
void write(ByteWriter& out, const std::vector<WorldRecord>& records);
[[nodiscard]] std::vector<WorldRecord> read_world_records(ByteReader& in);  ///< throws DecodeError

}  // namespace sim
