#include "trace/bsor_reader.h"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>

#include "trace/binary_place.h"
#include "trace/replay_frames.h"
#include "trace/text_cursor.h"
#include "trace/trace_limits.h"

namespace tracking {
namespace {

constexpr std::uint32_t kMagic = 0x442d3d69;
constexpr std::size_t kFrameBytes = 92;  // time, frames per second, three poses of seven floats
constexpr std::array<std::size_t, 2> kHandOffset = {36, 64};

/// Bytes with a place in a file. Little endian throughout.
class Bytes {
public:
    Bytes(std::string_view bytes, const std::string& name) : bytes_(bytes), name_(name) {}

    [[noreturn]] void fail(std::size_t at, const std::string& found, const std::string& expected) const {
        fail_at_byte(name_, at, found, expected, "check that the replay is complete, or download it again");
    }

    [[nodiscard]] std::size_t at() const { return at_; }
    [[nodiscard]] std::size_t left() const { return bytes_.size() - at_; }
    void skip(std::size_t count, const char* what) { at_ = take(count, what) + count; }

    std::uint8_t byte(const char* what) {
        const std::size_t from = take(1, what);
        ++at_;
        return static_cast<std::uint8_t>(bytes_[from]);
    }
    std::uint32_t word(const char* what) {
        const std::size_t from = take(4, what);
        at_ += 4;
        return word_at(from);
    }
    [[nodiscard]] double float_at(std::size_t from) const { return std::bit_cast<float>(word_at(from)); }
    [[nodiscard]] std::uint32_t word_at(std::size_t from) const {
        std::uint32_t value = 0;
        for (std::size_t i = 0; i < 4; ++i)
            value |= static_cast<std::uint32_t>(static_cast<std::uint8_t>(bytes_[from + i])) << (8 * i);
        return value;
    }
    std::string_view text(const char* what) {
        const std::size_t place = at_;
        const std::uint32_t length = word(what);
        if (length > left())
            fail(place, std::string(what) + " of " + std::to_string(length) + " bytes",
                 "at most the " + std::to_string(left()) + " bytes left");
        const std::string_view found = bytes_.substr(at_, length);
        at_ += length;
        return found;
    }

private:
    [[nodiscard]] std::size_t take(std::size_t count, const char* what) const {
        if (count > left())
            fail(bytes_.size(), std::string("the end of the file within ") + what, "the rest of it");
        return at_;
    }

    std::string_view bytes_;
    const std::string& name_;
    std::size_t at_ = 0;
};

/// Some recorders count the player's name in characters, not bytes: the platform after it is a text of 5, 6
/// or 8 bytes (steam, oculus, oculuspc), so the name ends where such a length stands.
void skip_player_name(Bytes& in) {
    const std::size_t counted = in.text("the player's name").size();
    for (std::size_t more = 0; more <= 3 * counted && in.left() >= more + 4; ++more) {
        const std::uint32_t length = in.word_at(in.at() + more);
        if (length != 5 && length != 6 && length != 8) continue;
        in.skip(more, "the player's name");
        return;
    }
}

std::string skip_info(Bytes& in) {
    if (in.byte("the information section") != 0)
        in.fail(in.at() - 1, "another section", "the information section, 0");
    for (const char* what :
         {"the recorder's version", "the game's version", "the time stamp", "the player's number"})
        static_cast<void>(in.text(what));
    skip_player_name(in);
    static_cast<void>(in.text("the platform"));
    std::string source = "Beat Saber Open Replay";
    for (const char* what : {"the tracking system", "the headset", "the controller"}) {
        const std::string_view text = in.text(what);
        if (!text.empty() && text.size() <= 100 && first_unprintable(text) == std::string_view::npos)
            source += ", " + std::string(text);
    }
    for (const char* what : {"the song's hash", "the song's name", "the mapper", "the difficulty"})
        static_cast<void>(in.text(what));
    in.skip(4, "the score");
    for (const char* what : {"the mode", "the environment", "the modifiers"})
        static_cast<void>(in.text(what));
    in.skip(4 + 1 + 4 + 4 + 4 + 4, "the information section");
    return source;
}

/// The frames as they lie in the file.
struct Frames {
    std::vector<std::size_t> at;  ///< where they begin
    std::vector<double> t_s;
};

Frames read_frames(Bytes& in) {
    if (in.byte("the frames") != 1) in.fail(in.at() - 1, "another section", "the frames, 1");
    const std::size_t place = in.at();
    const std::uint32_t count = in.word("the number of frames");
    if (count > in.left() / kFrameBytes)
        in.fail(place, std::to_string(count) + " frames",
                "at most the " + std::to_string(in.left() / kFrameBytes) + " that the file has room for");
    Frames frames;
    for (std::uint32_t k = 0; k < count; ++k) {
        frames.at.push_back(in.at());
        frames.t_s.push_back(in.float_at(in.at()));
        if (!(std::abs(frames.t_s.back()) <= kLatest))
            in.fail(in.at(), "a time that is no number within 1e7 s", "seconds");
        in.skip(kFrameBytes, "a frame");
    }
    return frames;
}

Eigen::Vector3d game_position(const Bytes& in, std::size_t at) {
    return {in.float_at(at), in.float_at(at + 4), in.float_at(at + 8)};
}

PoseSample pose(const Bytes& in, std::size_t at, double t_s) {
    PoseSample sample;
    sample.t_s = t_s;
    const Eigen::Vector3d p = game_position(in, at);
    if (!(p.cwiseAbs().maxCoeff() <= kFarthest) || !p.allFinite())
        in.fail(at, "a position that is no number within 1000 m", "metres");
    sample.position = {p.x(), p.y(), -p.z()};
    Eigen::Quaterniond q(in.float_at(at + 24), -in.float_at(at + 12), -in.float_at(at + 16),
                         in.float_at(at + 20));
    const double norm = q.norm();
    if (!(std::abs(norm - 1) <= kNormTolerance))
        in.fail(at + 12, "a quaternion of length " + std::to_string(norm), "length 1 within 1 %");
    q.coeffs() /= norm;
    sample.orientation = q;
    sample.has_orientation = true;
    return sample;
}

StickTrace read_hand(const Bytes& in, const Frames& frames, const std::vector<std::size_t>& kept,
                     std::size_t hand, const char* name) {
    StickTrace stick{name, {}};
    stick.samples.reserve(kept.size());
    for (const std::size_t k : kept) {
        PoseSample sample = pose(in, frames.at[k] + hand, frames.t_s[k]);
        if (!stick.samples.empty() && sample.orientation.dot(stick.samples.back().orientation) < 0)
            sample.orientation.coeffs() *= -1;
        stick.samples.push_back(sample);
    }
    return stick;
}

}  // namespace

bool is_bsor(std::string_view bytes) {
    return bytes.starts_with(std::string_view("\x69\x3d\x2d\x44", 4));
}

Trace parse_bsor(std::string_view bytes, const std::string& name) {
    Bytes in(bytes, name);
    Trace trace;
    trace.file = name;
    if (in.word("the magic number") != kMagic) in.fail(0, "another magic number", "a Beat Saber Open Replay");
    const int version = in.byte("the format's version");
    if (version != 1) in.fail(4, "format version " + std::to_string(version), "version 1");
    trace.source = skip_info(in);
    trace.tip = Eigen::Vector3d(0, 0, -0.35);
    trace.shaft = -Eigen::Vector3d::UnitZ();
    const std::size_t place = in.at();
    const Frames frames = read_frames(in);
    const std::vector<std::size_t> kept = frames_that_count(
        frames.t_s, kHandOffset.size(),
        [&](std::size_t k, std::size_t hand) { return game_position(in, frames.at[k] + kHandOffset[hand]); },
        trace.remarks);
    if (kept.size() < 2)
        in.fail(place, std::to_string(kept.size()) + " frames after the start-up", "at least two");
    trace.sticks = {read_hand(in, frames, kept, kHandOffset[0], "left"),
                    read_hand(in, frames, kept, kHandOffset[1], "right")};
    return trace;
}

}  // namespace tracking
