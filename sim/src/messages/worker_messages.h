#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "bytes/fields.h"
#include "messages/market_messages.h"
#include "messages/secret.h"
#include "messages/struck_messages.h"
#include "messages/update_codec.h"
#include "sim/distributed_world.h"
#include "world/shared_world.h"

namespace sim {

// Messages between an application and its workers, and among workers: of a world that is simulated together,
// and of the struck bodies of a play. One ZeroMQ frame each, little-endian, no padding: a header, then the
// fields that a message declares beside its struct.
//
//   offset  bytes
//   0       4      "MWSW"
//   4       2      version
//   6       2      type: place in WorkerMessage, from 1
//   8       4      length of the whole message
//   12      4      worker: sender; 0xffffffff the application
//   16      4      epoch of ownership, as the sender knows it
//   20      8      step: number of steps that the sender has done
//   28      ...    the message's fields
//
// docs/formats.md lists all messages; a test makes that list from the declarations. Decoders check length,
// counts, flags, numbers, that nothing is left over, and a scene as World would; else they throw DecodeError.

constexpr std::uint32_t kApplication = 0xffffffff;
constexpr std::uint16_t kProtocol = 16;  ///< version, of messages and of how worlds step

struct MessageHeader {
    std::uint32_t worker = kApplication;
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;  ///< the sender's: number of steps it has done
};

/// What happened to an own body or constraint for the first time.
struct Mishap {
    enum class Kind : std::uint8_t { quarantined, limited, broken } kind = Kind::quarantined;
    std::uint32_t number = 0;  ///< of the body; of the constraint that broke
    std::uint64_t step = 0;
    std::string what;  ///< quarantined: which value
};
void fields(auto& archive, Is<Mishap> auto& m) {
    archive("kind number step what", Choice{m.kind, Mishap::Kind::broken}, m.number, m.step,
            Words{m.what, 64});
}

constexpr std::uint32_t kLongestText = 4096;

/// A worker's report of its last step, in every state and update message.
struct StepReport {
    float seconds = 0, smoothed_s = 0, waited_s = 0, processor_s = 0;  ///< see WorkerStep
    std::uint32_t lead = 0, ghost_age = 0, cross_contacts = 0;
    std::uint32_t own = 0;
    Eigen::Vector3d outside_impulse = Eigen::Vector3d::Zero();  ///< since this worker's start
    std::vector<Mishap> mishaps;                                ///< of the step
};
void fields(auto& archive, Is<StepReport> auto& r) {
    const auto time = [](auto& seconds) { return Within{seconds, 0, kLongestTime_s}; };
    archive("seconds smoothed_s waited_s processor_s", time(r.seconds), time(r.smoothed_s), time(r.waited_s),
            time(r.processor_s));
    archive("lead ghost_age cross_contacts own", r.lead, r.ghost_age, r.cross_contacts, r.own);
    archive("outside_impulse mishaps", finite(r.outside_impulse), r.mishaps);
}

struct JoinRequest {
    static constexpr const char* kRoute = "worker to application";
    Secret secret = {};
    std::string host;  ///< printable ASCII, whatever was sent; at most 255 characters
};
void fields(auto& archive, Is<JoinRequest> auto& m) {
    archive("secret host", m.secret, Words{m.host, 255});
}

struct Beat {  ///< every 0.1 s
    static constexpr const char* kRoute = "worker to application, and back";
    Secret secret = {};  ///< the worker's; zeros from the application
};
void fields(auto& archive, Is<Beat> auto& m) {
    archive("secret", m.secret);
}

struct Drained {  ///< has given away all it owned and leaves
    static constexpr const char* kRoute = "worker to application";
};
struct Leaves {  ///< wants to leave; gets a Gather for all it owns
    static constexpr const char* kRoute = "worker to application";
};

struct WorkerFailure {  ///< cannot go on
    static constexpr const char* kRoute = "worker to application";
    std::string what;
};
void fields(auto& archive, Is<WorkerFailure> auto& m) {
    archive("what", Words{m.what, kLongestText});
}

struct SceneMessage {
    static constexpr const char* kRoute = "application to one worker";
    std::uint32_t worker = 0;  ///< number of the joining worker
    WorldScene scene;
    DistributedSettings settings;
};
void fields(auto& archive, Is<SceneMessage> auto& m) {
    archive("worker scene settings", m.worker, m.scene, m.settings);
}

struct Refusal {  ///< of a join; or the worker was given up
    static constexpr const char* kRoute = "application to one worker";
    std::string why;
};
void fields(auto& archive, Is<Refusal> auto& m) {
    archive("why", Words{m.why, kLongestText});
}

struct EndOfRun {
    static constexpr const char* kRoute = "application to all workers";
};

struct Members {
    static constexpr const char* kRoute = "application to all workers";
    std::vector<std::uint32_t> workers;
    /// Owners of some bodies follow, then this message again without the flag. Until then nobody steps.
    bool owners_follow = false;
};
void fields(auto& archive, Is<Members> auto& m) {
    archive("workers owners_follow", m.workers, m.owners_follow);
}

/// Impulses at the contacts of own bodies with others' that a worker found in a step.
struct FoundStep {
    std::uint64_t step = 0;
    std::vector<CrossImpulse> crossed;  ///< as floats; ascending by (own, ghost)
};
void fields(auto& archive, Is<FoundStep> auto& m) {
    archive("step crossed", m.step, Packed{m.crossed});
}

/// Registered ownership: `owner` steps these bodies from the end of step `step` on. The header's epoch is the
/// new one.
struct Ownership {
    static constexpr const char* kRoute = "application to all workers";
    std::uint32_t owner = 0;
    std::uint32_t from = kApplication;  ///< the owner before; kApplication: none
    bool traded = false;                ///< to a buyer; else at the start, or after a loss
    std::uint64_t step = 0;
    std::vector<WorldRecord> bodies;  ///< exact; without a handover as last published
    /// To the owner alone, to which nobody sent them so far: others' bodies near these, as last published.
    std::vector<WorldRecord> around = {};
    std::vector<std::uint64_t> around_step = {};  ///< of each
};
void fields(auto& archive, Is<Ownership> auto& m) {
    archive("owner from traded step", m.owner, m.from, m.traded, m.step);
    archive("bodies around around_step", m.bodies, m.around, m.around_step);
    archive.check(m.around.size() == m.around_step.size(), "bodies around without their steps");
}

/// A body had another owner up to the end of a step.
struct PastSale {
    std::uint32_t body, before;
    std::uint64_t step;
};
void fields(auto& archive, Is<PastSale> auto& s) {
    archive("body before step", s.body, s.before, s.step);
}

/// For a worker that joins late: what has been up to the header's step, which all have done.
struct PastMessage {
    static constexpr const char* kRoute = "application to one worker";
    std::vector<std::uint32_t> broken;  ///< constraints that hold no more
    std::vector<PastSale> sales;        ///< of the steps that are still compared; of each body ascending
};
void fields(auto& archive, Is<PastMessage> auto& m) {
    archive("broken sales", m.broken, m.sales);
}

/// Own bodies once more after the last step, exact, as what came late has put them right.
struct StateMessage {
    static constexpr const char* kRoute = "worker to application";
    StepReport report;
    std::vector<WorldRecord> bodies;
};
void fields(auto& archive, Is<StateMessage> auto& m) {
    archive("report bodies", m.report, m.bodies);
}

/// After each step: all that it made of own bodies.
struct UpdateMessage {
    static constexpr const char* kRoute = "worker to application";
    StepReport report;
    std::vector<Update> bodies;         ///< own, ascending
    std::vector<std::uint32_t> broken;  ///< constraints that broke in the step
};
void fields(auto& archive, Is<UpdateMessage> auto& m) {
    archive("report bodies broken", m.report, Packed{m.bodies}, m.broken);
}

constexpr double kFurthestReach = 1e8, kFastestReach = 1e9;  ///< from the origin [m]; [m/s]
/// Where a worker's bodies are and go, see shared/nearness.h: a box around them [m], which is empty if it has
/// none; of its two longest sides, each cut into 8, those of the 64 parts in which they are.
struct Reach {
    Eigen::AlignedBox3f box;
    std::uint64_t parts = 0;
    float speed = 0;  ///< of the fastest [m/s]
};
template <typename Archive>
void fields(Archive& archive, Is<Reach> auto& r) {
    Eigen::Vector3f low = r.box.min(), high = r.box.max();
    if (r.box.isEmpty()) low.setOnes(), high.setZero();
    archive("low high", Within{low, -kFurthestReach, kFurthestReach},
            Within{high, -kFurthestReach, kFurthestReach});
    archive("parts speed", r.parts, Within{r.speed, 0, kFastestReach});
    if constexpr (Archive::kReads) r.box = {low, high};
}

/// After each step to each other worker: what the receiver needs of it. Bodies that it does not name are not
/// near the receiver's, unless they sleep and an earlier message said so.
struct NeighbourMessage {
    static constexpr const char* kRoute = "worker to worker";
    std::uint32_t to = 0;
    std::uint64_t acknowledged = 0;  ///< step of the receiver's last message that has reached the sender
    float smoothed_s = 0;            ///< see WorkerStep
    std::uint32_t own = 0;           ///< number of the sender's bodies
    Reach reach;                     ///< of these
    PackedUpdates bodies;            ///< ascending
    /// Of own bodies with the receiver's in the last step, as floats; ascending.
    std::vector<CrossImpulse> crossed;
    std::vector<std::uint32_t> broken;  ///< constraints that broke in the step
    struct Place {
        std::uint32_t body = 0;
        Eigen::Vector3f position = Eigen::Vector3f::Zero();
    };
    std::vector<Place> places;  ///< of all own bodies, every kPlacesEvery steps, for load balancing
};
constexpr std::uint64_t kPlacesEvery = 32;
void fields(auto& archive, Is<NeighbourMessage::Place> auto& p) {
    archive("body position", p.body, finite(p.position));
}
template <typename Archive>
void fields(Archive& archive, Is<NeighbourMessage> auto& m) {
    bool bodies = !m.bodies.places().empty(), crossed = !m.crossed.empty(), broken = !m.broken.empty(),
         places = !m.places.empty();
    archive("bodies,crossed,broken,places", Bits{bodies, crossed, broken, places});  // which lists follow
    archive("to acknowledged smoothed_s own reach", m.to, m.acknowledged,
            Within{m.smoothed_s, 0, kLongestTime_s}, m.own, m.reach);
    if constexpr (Archive::kReads) m.bodies.clear(), m.crossed.clear(), m.broken.clear(), m.places.clear();
    if (bodies) archive("bodies", Packed{m.bodies});
    if (crossed) archive("crossed", Packed{m.crossed});
    if (broken) archive("broken", m.broken);
    if (places) archive("places", m.places);
    archive.check(bodies != m.bodies.places().empty() && crossed != m.crossed.empty() &&
                      broken != m.broken.empty() && places != m.places.empty(),
                  "an empty list");
}

/// To who has just got bodies: what the sender found at them in the last steps.
struct FoundMessage {
    static constexpr const char* kRoute = "worker to worker";
    std::uint32_t to = 0;
    std::uint32_t epoch = 0;  ///< in which they changed owners
    std::vector<FoundStep> steps;
};
void fields(auto& archive, Is<FoundMessage> auto& m) {
    archive("to epoch steps", m.to, m.epoch, m.steps);
}

using WorkerMessage =
    std::variant<JoinRequest, Beat, Drained, WorkerFailure, SceneMessage, Refusal, EndOfRun, Members,
                 Ownership, PastMessage, StateMessage, UpdateMessage, Offer, OfferAnswer, Handover,
                 StruckAssign, StruckStep, StruckAnswer, Gather, Leaves, NeighbourMessage, FoundMessage>;

[[nodiscard]] std::vector<std::uint8_t> encode(const MessageHeader& header, const WorkerMessage& message);
struct DecodedMessage {
    MessageHeader header;
    WorkerMessage message;
};
/// Throws DecodeError for anything that encode cannot have written.
[[nodiscard]] DecodedMessage decode_message(std::span<const std::uint8_t> bytes);
/// The same, into the storage of the last one; what is there after a DecodeError is of no use.
void decode_message(std::span<const std::uint8_t> bytes, DecodedMessage& into);

}  // namespace sim
