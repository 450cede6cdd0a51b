#pragma once
#include <memory>
#include <span>
#include <string>

struct CSOUND_;  // Csound's own handle; csound.h stays out of this header

namespace audio {

/// One Csound instance: 48 kHz, stereo, or stereo and what a room hears of it (four channels), sample-accurate, no device, rendered block by block. The one owner of
/// Csound. To be created, used and destroyed on one thread, which Csound leaves with denormals off (DAZ,
/// FTZ). Plugin opcodes are not loaded (none is needed, and a process that loads them dies after some hundred
/// instances): the first instance of the process points Csound's own OPCODE6DIR64 to no folder, once, under
/// the language's guard; the process's environment is left alone.
class CsoundEngine {
public:
    /// Compiles and starts an orchestra; `source` names it in messages. Throws std::runtime_error with
    /// Csound's own message where it does not compile, or where it is not 48 kHz stereo at 0dbfs = 1.
    CsoundEngine(const std::string& orchestra, const std::string& source);

    [[nodiscard]] int block_size() const { return block_size_; }  ///< ksmps [samples]
    [[nodiscard]] std::size_t channels() const { return channels_; }
    /// Number of a named instrument; throws std::runtime_error.
    [[nodiscard]] double instrument_number(const std::string& name);
    /// The function table; valid until the engine ends. Throws std::runtime_error.
    [[nodiscard]] std::span<double> table(int number);
    /// Makes a function table of these values. Throws std::runtime_error.
    void make_table(int number, std::span<const float> values);
    /// Adds an `i` event: p1, p2, ... with p2 in seconds from the current block's start.
    void start_note(std::span<const double> p_fields);
    /// Renders the next block: block_size() interleaved frames of channels() samples, valid until the next call. Throws
    /// std::runtime_error where an instrument failed.
    [[nodiscard]] std::span<const double> render_block();

    [[nodiscard]] static std::string version();  ///< "Csound 6.18.1"

private:
    struct Destroy {
        void operator()(CSOUND_* csound) const noexcept;
    };
    static void receive_message(CSOUND_* csound, int attributes, const char* text);
    void check_format() const;
    void check_messages() const;

    std::string source_;
    std::string messages_;  ///< since the last check, at most kMessageLimit
    bool failed_ = false;   ///< an error message came
    int block_size_ = 0;
    std::size_t channels_ = 2;
    std::unique_ptr<CSOUND_, Destroy> csound_;
};

}  // namespace audio
