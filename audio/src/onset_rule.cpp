#include "onset_rule.h"

#include <array>
#include <span>
#include <stdexcept>

#include "audio/performance.h"
#include "csound_engine.h"

namespace audio {
namespace {

// A note shorter than a block makes Csound 6.18 copy a negative number of samples (and die): four blocks are
// safe.
constexpr int kNoteBlocks = 4;
constexpr int kBlocksHeard = 8;  // an impulse that comes later is as wrong as one that never comes

std::string impulse_orchestra(int block_size) {
    return "sr = 48000\nksmps = " + std::to_string(block_size) +
           "\nnchnls = 2\n0dbfs = 1\n"
           "instr impulse\n ablow linseg 1, 1 / sr, 0, 1, 0\n outs ablow, ablow\nendin\n";
}

/// Whether an impulse asked for `offset` samples into the coming block is one sample of 1 there and nothing
/// else.
bool sounds_at(CsoundEngine& engine, double instrument, OnsetRule rule, int offset) {
    const double duration = static_cast<double>(kNoteBlocks * engine.block_size()) / kSampleRate;
    const std::array p_fields{instrument, onset_p2(rule, offset, engine.block_size()), duration};
    engine.start_note(p_fields);
    bool exact = true;
    for (int block = 0; block < kBlocksHeard; ++block) {
        const std::span<const double> frames = engine.render_block();
        for (int frame = 0; frame < engine.block_size(); ++frame) {
            const double expected = block == 0 && frame == offset ? 1 : 0;
            exact = exact && frames[2 * static_cast<std::size_t>(frame)] == expected;
        }
    }
    return exact;
}

bool is_exact(CsoundEngine& engine, double instrument, OnsetRule rule) {
    for (int offset = 0; offset < engine.block_size(); ++offset) {
        if (!sounds_at(engine, instrument, rule, offset)) return false;
    }
    return true;
}

}  // namespace

double onset_p2(OnsetRule rule, int offset, int block_size) {
    const bool late_half = rule == OnsetRule::half_block && 2 * offset >= block_size;
    return (offset + 0.01) / kSampleRate - (late_half ? static_cast<double>(block_size) / kSampleRate : 0);
}

OnsetRule probe_onset_rule(int block_size) {
    CsoundEngine engine(impulse_orchestra(block_size), "onset probe");
    const double instrument = engine.instrument_number("impulse");
    for (const OnsetRule rule : {OnsetRule::exact, OnsetRule::half_block}) {
        if (is_exact(engine, instrument, rule)) return rule;
    }
    throw std::runtime_error(CsoundEngine::version() + ": no known rule starts notes at their exact sample");
}

std::string describe(OnsetRule rule) {
    return rule == OnsetRule::exact ? "sample-accurate: exact"
                                    : "sample-accurate: second half of a block corrected";
}

}  // namespace audio
