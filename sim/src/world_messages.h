#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "byte_codec.h"
#include "sim/distributed_world.h"

namespace sim {

// Messages of a distributed world. (Byte-by-byte table: to be written with the codec.)
//
// Header, 28 bytes: "MWSW", u16 version, u16 type, u32 length of the whole message, u32 worker (sender;
// 0xffffffff the application), u32 epoch (of ownership, as the sender knows it), u64 step; at the end u32
// CRC-32C of everything before.

constexpr std::uint32_t kApplication = 0xffffffff;

struct WorldHeader {
    std::uint32_t worker = kApplication;
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;  ///< the sender's: number of steps it has done
};

/// What a worker tells of its last step, in every state and update message.
struct StepReport {
    float seconds = 0, smoothed_s = 0, waited_s = 0, bodies_cost_s = 0;
    std::uint32_t lead = 0, ghost_age = 0, cross_contacts = 0;
    std::uint32_t own = 0;
    Eigen::Vector3d outside_impulse = Eigen::Vector3d::Zero();  ///< since this worker's start
};

// Worker to application.
struct JoinRequest {
    std::uint64_t fingerprint = 0;
    std::uint32_t process = 0;
    std::string host;
};
struct WorldBeat {};    ///< both ways, every 0.1 s
struct Drained {};      ///< worker: has given away all it owned and leaves
struct WorkerFailure {  ///< worker: cannot go on
    std::string what;
};

// Application to one worker.

struct SceneMessage {
    std::uint32_t worker = 0;  ///< the number of the one who joins
    WorldScene scene;
    DistributedSettings settings;
};
struct Refusal {  ///< of a join, or: you were given up
    std::string why;
};
struct EndOfRun {};

// Application to all workers.
struct Members {
    std::vector<std::uint32_t> workers;
};
/// Registered ownership: from the end of step `step` on `owner` steps these bodies. The header's epoch is the
/// new one.
struct Ownership {
    std::uint32_t owner = 0;
    std::uint32_t from = kApplication;  ///< who owned them before; kApplication: nobody
    bool traded = false;                ///< by handover; else at the start or after a loss
    std::uint64_t step = 0;
    std::vector<WorldRecord> bodies;     ///< exact; without a handover in bounded pace as last published
    std::vector<std::uint64_t> applied;  ///< bounded: see UpdateMessage; one for each entry of `sources`
    std::vector<std::uint32_t> sources;
};
/// Everything at the end of a step that all have done, for who joins late.
struct SnapshotMessage {
    WorldSnapshot snapshot;
};

// Worker to all, through the application, after each step.

/// Lockstep. All own bodies, and the contacts and constraints that belong to them.
struct StateMessage {
    StepReport report;
    std::vector<WorldRecord> bodies;
    std::vector<ContactRecord> contacts;
    std::vector<SpringRecord> springs;
};

/// Bounded. A push: what the sender's bodies did to a body of another in the step that ended.
struct Push {
    std::uint32_t body = 0;
    StepImpulse impulse;  ///< linear and angular exact, the rest as floats
};
/// One body's state, quantised: at most 120 bytes with 12 modes.
struct Update {
    std::uint32_t body = 0;
    bool asleep = false, still = false, quarantined = false;
    WorldBodyState state;
    bool held = false;    ///< whether `impulse` is there
    StepImpulse impulse;  ///< from the owner's other bodies, lasting; linear, angular, modal
};
struct UpdateMessage {
    StepReport report;
    /// Pushes that the states include: for each source worker all of its messages up to this step.
    std::vector<std::uint32_t> sources;
    std::vector<std::uint64_t> applied;
    std::vector<Update> bodies;
    std::vector<Push> pushes;
};

// Worker to worker, through the application. The market.
struct Offer {
    std::uint32_t to = 0, number = 0;  ///< number: of the seller's offers
    std::vector<std::uint32_t> bodies;
    std::vector<float> cost_s;  ///< of each, at the seller
};
struct OfferAnswer {
    std::uint32_t to = 0, number = 0;
    bool accepted = false;
};
/// To the application, which registers it or gives the bodies back: exact states at the end of the header's
/// step.
struct Handover {
    std::uint32_t to = 0, number = 0;
    std::vector<WorldRecord> bodies;
    std::vector<std::uint32_t> sources;
    std::vector<std::uint64_t> applied;
};

using WorldMessage =
    std::variant<JoinRequest, WorldBeat, Drained, WorkerFailure, SceneMessage, Refusal, EndOfRun, Members,
                 Ownership, SnapshotMessage, StateMessage, UpdateMessage, Offer, OfferAnswer, Handover>;

[[nodiscard]] std::vector<std::uint8_t> encode(const WorldHeader& header, const WorldMessage& message);
struct DecodedWorldMessage {
    WorldHeader header;
    WorldMessage message;
};
/// Throws DecodeError for anything that encode cannot have written.
[[nodiscard]] DecodedWorldMessage decode_world(std::span<const std::uint8_t> bytes);

}  // namespace sim
