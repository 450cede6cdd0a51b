#pragma once
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "bytes/byte_codec.h"
#include "messages/secret.h"
#include "messages/struck_messages.h"
#include "sim/distributed_world.h"
#include "world/shared_world.h"

namespace sim {

// Messages between applications and their workers, and among these: of a world that is simulated together, and of the struck bodies
// of a play. One ZeroMQ frame each, little-endian, no padding.
//
//   offset  bytes
//   0       4      "MWSW"
//   4       2      version, 16
//   6       2      type
//   8       4      length of the whole message
//   12      4      worker: sender; 0xffffffff the application
//   16      4      epoch of ownership, as the sender knows it
//   20      8      step: number of steps that the sender has done
//   28      ...    body, by type
//
// f64, f32, f16 are IEEE numbers bit by bit, v3 = 3 f64, w3 = 3 f32, flag = u8 of 0 or 1, text = u32 length
// and bytes, list = u32 count and the elements, b/m = u32: body below 2^24, and number of modes (at most
// 128) times 2^24.
//
//    1 join       worker  16 bytes: its secret, text host
//    2 beat       both    16 bytes: the worker's secret; zeros from the application
//    3 drained    worker  nothing
//    4 failure    worker  text
//    5 scene      app     u32 worker, scene, settings
//    6 refusal    app     text
//    7 end        app     nothing
//    8 members    app     list of u32, flag owners follow
//    9 ownership  app     u32 owner, u32 from, flag traded, u64 step, list of record, list of record and of u64
//                         (around, their steps)
//   10 past       app     list of u32 (constraints that hold no more), list of {u32 body, u32 before, u64 step} (sales)
//   11 state      worker  report, list of record
//   12 update     worker  report, lists of update, u32 (constraints that broke)
//   13 offer      worker  u32 to, u32 number, flag gathers, list of {u32 body, f32 seconds}
//   14 answer     worker  u32 to, u32 number, flag accepted
//   15 handover   worker  u32 to, u32 number, list of record
//   16 to 18 of struck bodies, see struck_messages.h; of the others a play and its workers use 1, 2, 4, 6 and 7
//   19 gather     app     u32 to, list of u32 (bodies)
//   20 leaves     worker  nothing
//   21 neighbour  worker  u8 (1 bodies, 2 crossed, 4 broken, 8 places), u32 to, u64 heard, f32 smoothed, u32 own,
//                         w3 low, w3 high, u64 parts, f32 speed; lists, if they are there, of update, crossed,
//                         u32 (constraints that broke), place
//   22 found      worker  u32 to, u32 epoch, list of {u64 step, list of crossed}
//
//   report      60 bytes and its mishaps: f32 seconds, smoothed, waited, processor; u32 lead, ghost age,
//               cross contacts, own; v3 outside impulse; list of {u8 kind, u32 number, u64 step, text}
//   record      115 + 16 m bytes, 307 with 12 modes: b/m, u8 (1 asleep, 2 quarantined, 4 at limit, 8 broken),
//               u16 still steps, i32 sleep group, v3 position, f64 orientation w x y z, v3 velocity,
//               v3 angular momentum, f64 q[m], f64 q'[m]
//   update      37 + 3 m bytes, 73 with 12 modes, 36 with none; if held, 13 + m more, 98 in all:
//               b/m, u8 (1 asleep, 2 still, 4 quarantined, 8 held, and 16 times E), w3 position,
//               7 bytes orientation, 3 f16 velocity, 3 i16 angular momentum in units of
//               2^(4 E - 44) kg m^2/s, f16 q[m], small q'[m]; held: 3 f16 linear, 3 f16 angular, small modal[m]
//   small       of n numbers, if there are any: i8 E, n i8 in units of 2^E, E the least with which none is beyond 127
//   place       16 bytes: u32 body, w3 position
//   crossed     33 bytes: u32 own (+ 2^31: blow), u32 other, u8 E of the first and 16 times E of the second, w3 linear on own,
//               3 i16 angular on own, 3 i16 angular on other, in units of 2^(4 E - 44) kg m^2/s
//   scene, settings: see world_scene_codec.cpp
//
// The 7 bytes of an orientation: 56 bits, lowest first: which of x, y, z, w is largest in size (2 bits; it is
// made positive and follows from the others), the other three in that order, each 18 bits, 0 to 2^18 - 1 for
// -1/sqrt 2 to 1/sqrt 2.
//
// Largest quantisation errors of an update: position 2^-24 of each coordinate; orientation 1.9e-5 rad;
// angular momentum 1/4095 of its largest coordinate (plus 2^-45 kg m^2/s; range 2.1e9); f16 2^-11 of each
// number (plus 3e-8; range 65504); small 1/127 of the largest (plus 2^-129).
//
// A state that is not finite or beyond 1e7 m or 1e6 m/s is broken; World takes the body out at the next
// step. Its numbers do not travel: zeros stand for them (and w = 1 for the orientation; in an update the
// angular momentum is -32768 three times), and the decoder sets the position to NaN.
//
// Decoders check length, counts, flags, that every number is finite and in range, that nothing is
// left over, and a scene as World would; else they throw DecodeError.

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

/// A worker's report of its last step, in every state and update message.
struct StepReport {
    float seconds = 0, smoothed_s = 0, waited_s = 0, processor_s = 0;  ///< see WorkerStep
    std::uint32_t lead = 0, ghost_age = 0, cross_contacts = 0;
    std::uint32_t own = 0;
    Eigen::Vector3d outside_impulse = Eigen::Vector3d::Zero();  ///< since this worker's start
    std::vector<Mishap> mishaps;                                ///< of the step
};

// Worker to application.
struct JoinRequest {
    Secret secret = {};
    std::string host;  ///< printable ASCII, whatever was sent; at most 255 characters
};
struct Beat {  ///< both ways, every 0.1 s
    Secret secret = {};
};
struct Drained {};      ///< worker: has given away all it owned and leaves
struct Leaves {};       ///< worker: wants to; gets a Gather for all it owns
struct WorkerFailure {  ///< worker: cannot go on
    std::string what;
};

// Application to one worker.

struct SceneMessage {
    std::uint32_t worker = 0;  ///< number of the joining worker
    WorldScene scene;
    DistributedSettings settings;
};
struct Refusal {  ///< of a join; or the worker was given up
    std::string why;
};
struct EndOfRun {};

// Application to all workers.
struct Members {
    std::vector<std::uint32_t> workers;
    /// Owners of some bodies are told next, then this message comes again without the flag. Until then nobody
    /// steps.
    bool owners_follow = false;
};
/// Impulses at the contacts of own bodies with others' that a worker found in a step.
struct FoundStep {
    std::uint64_t step = 0;
    std::vector<CrossImpulse> crossed;  ///< as floats; ascending by (own, ghost)
};
/// Registered ownership: `owner` steps these bodies from the end of step `step` on. The header's epoch is the
/// new one.
struct Ownership {
    std::uint32_t owner = 0;
    std::uint32_t from = kApplication;  ///< the owner before; kApplication: none
    bool traded = false;                ///< to a buyer; else at the start, or after a loss
    std::uint64_t step = 0;
    std::vector<WorldRecord> bodies;  ///< exact; without a handover as last published
    /// To the owner alone, which was not told of what is here before: others' bodies near these, as last published.
    std::vector<WorldRecord> around = {};
    std::vector<std::uint64_t> around_step = {};  ///< of each
};
/// A body had another owner up to the end of a step.
struct PastSale {
    std::uint32_t body, before;
    std::uint64_t step;
};
/// For a worker that joins late: what has been up to the header's step, which all have done.
struct PastMessage {
    std::vector<std::uint32_t> broken;  ///< constraints that hold no more
    std::vector<PastSale> sales;        ///< of the steps that are still compared; of each body ascending
};

// Worker to the application after each step.

/// Own bodies once more after the last step, exact, as what came late has put them right.
struct StateMessage {
    StepReport report;
    std::vector<WorldRecord> bodies;
};

/// One body's state, quantised: at most 98 bytes with 12 modes.
struct Update {
    std::uint32_t body = 0;
    bool asleep = false, still = false, quarantined = false;
    WorldBodyState state;
    bool held = false;    ///< whether `impulse` is there
    StepImpulse impulse;  ///< from the owner's other bodies, the mean of a step; linear, angular, modal
};
struct UpdateMessage {  ///< all that the step made of own bodies
    StepReport report;
    std::vector<Update> bodies;         ///< own, ascending
    std::vector<std::uint32_t> broken;  ///< constraints that broke in the step
};

/// Updates as bytes: of those that one worker tells another few are needed soon, and those are read then.
class PackedUpdates {
public:
    struct Place {
        std::uint32_t body, offset;
        Eigen::Index modes;
        bool asleep, quarantined;
        Eigen::Vector3d position, velocity;  ///< [m], [m/s]
    };
    [[nodiscard]] const std::vector<Place>& places() const noexcept { return places_; }
    [[nodiscard]] std::span<const std::uint8_t> bytes() const noexcept { return bytes_; }
    void clear() { bytes_.clear(), places_.clear(); }
    void add(const Update& update);
    /// One of other packed updates.
    void add(const PackedUpdates& from, const Place& place);
    /// Those that follow there; each is read once. Throws DecodeError.
    void read(ByteReader& in);
    void read(const Place& place, Update& into) const;

private:
    std::vector<std::uint8_t> bytes_;
    std::vector<Place> places_;
};

// Worker to worker, through the application, which passes them on in the order in which they came.

constexpr double kFurthestReach = 1e8;  ///< of a reach, from the origin [m]
/// Where a worker's bodies are and go, see shared/nearness.h: a box around them [m], which is empty if it has none; of its two longest
/// sides, each cut into 8, those of the 64 parts in which they are.
struct Reach {
    Eigen::AlignedBox3f box;
    std::uint64_t parts = 0;
    float speed = 0;  ///< of the fastest [m/s]
};
/// After each step to each other worker: what the receiver needs of it. Bodies that it does not name are not near the
/// receiver's, unless they sleep and it was told so.
struct NeighbourMessage {
    std::uint32_t to = 0;
    std::uint64_t heard = 0;  ///< step of the receiver's last message that the sender has heard
    float smoothed_s = 0;     ///< see WorkerStep
    std::uint32_t own = 0;    ///< number of the sender's bodies
    Reach reach;              ///< of these
    PackedUpdates bodies;     ///< ascending
    std::vector<CrossImpulse>
        crossed;  ///< of own bodies with the receiver's in the last step, as floats; ascending
    std::vector<std::uint32_t> broken;  ///< constraints that broke in the step
    struct Place {
        std::uint32_t body = 0;
        Eigen::Vector3f position = Eigen::Vector3f::Zero();
    };
    std::vector<Place> places;  ///< of all own bodies, every kPlacesEvery steps, for load balancing
};
constexpr std::uint64_t kPlacesEvery = 32;
/// To who has just got bodies: what the sender found at them in the last steps.
struct FoundMessage {
    std::uint32_t to = 0;
    std::uint32_t epoch = 0;  ///< in which they changed owners
    std::vector<FoundStep> steps;
};

// Likewise, of the market.
struct Offer {
    std::uint32_t to = 0, number = 0;  ///< number: of the seller's offers
    std::vector<std::uint32_t> bodies;
    std::vector<float> cost_s;  ///< of each, at the seller
    bool gathers = false;       ///< as the application asked, see Gather: whatever it costs
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
};

/// From the application: these bodies belong to a structure (shared/structures.h) of which another worker has
/// most, or their owner leaves: it offers them to that one. To the application: there is no other, it hands over what it has.
struct Gather {
    std::uint32_t to = 0;
    std::vector<std::uint32_t> bodies;
};

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
