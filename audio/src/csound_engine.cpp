#include "csound_engine.h"

#include <csound.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <type_traits>

#include "audio/performance.h"
#include "opcodes.h"

namespace audio {
namespace {

static_assert(std::is_same_v<MYFLT, double>, "the 64-bit Csound library is expected");

constexpr std::size_t kMessageLimit = 600;

/// Once a process, before its first instance: no signal handlers, no exit handler, no plugin folder.
void prepare_library() {
    static const bool prepared = [] {
        return csoundInitialize(CSOUNDINIT_NO_SIGNAL_HANDLER | CSOUNDINIT_NO_ATEXIT) >= 0 &&
               csoundSetGlobalEnv("OPCODE6DIR64", "") == 0;
    }();
    if (!prepared) throw std::runtime_error("Csound: the library could not be initialised");
}

bool is_error(std::string_view text) {
    // "INIT ERROR in instr", "PERF ERROR in instr", "error: syntax error", "note deleted": not "0 errors in
    // performance".
    return text.find("ERROR") != text.npos || text.find("rror:") != text.npos ||
           text.find("note deleted") != text.npos;
}

}  // namespace

void CsoundEngine::Destroy::operator()(CSOUND_* csound) const noexcept {
    csoundDestroy(csound);
}

CsoundEngine::CsoundEngine(const std::string& orchestra, const std::string& source) : source_(source) {
    prepare_library();
    csound_.reset(csoundCreate(this));
    if (!csound_) throw std::runtime_error("Csound: no instance could be created");
    csoundSetMessageStringCallback(csound_.get(), &CsoundEngine::receive_message);
    for (const char* option : {"-n", "-d", "-m0", "--sample-accurate"}) {
        if (csoundSetOption(csound_.get(), option) != 0) {
            throw std::runtime_error(std::string("Csound refuses its option ") + option);
        }
    }
    add_opcodes(csound_.get());
    if (csoundCompileOrc(csound_.get(), orchestra.c_str()) != 0 || csoundStart(csound_.get()) != 0)
        failed_ = true;
    check_messages();
    check_format();
    block_size_ = static_cast<int>(csoundGetKsmps(csound_.get()));
    channels_ = csoundGetNchnls(csound_.get());
}

void CsoundEngine::receive_message(CSOUND* csound, int, const char* text) {
    auto* engine = static_cast<CsoundEngine*>(csoundGetHostData(csound));
    if (is_error(text)) engine->failed_ = true;
    engine->messages_ += text;
    // What matters stands last, after what the preprocessor says of macros.
    if (engine->messages_.size() > 2 * kMessageLimit)
        engine->messages_.erase(0, engine->messages_.size() - kMessageLimit);
}

void CsoundEngine::check_messages() const {
    if (!failed_) return;
    std::string text = messages_.substr(messages_.size() - std::min(messages_.size(), kMessageLimit));
    std::ranges::replace(text, '\n', ' ');
    throw std::runtime_error(source_ + ": Csound reports: " + text);
}

void CsoundEngine::check_format() const {
    CSOUND* csound = csound_.get();
    const auto channels = csoundGetNchnls(csound);
    if (csoundGetSr(csound) != kSampleRate || (channels != 2 && channels != 4) ||
        csoundGet0dBFS(csound) != 1) {
        throw std::runtime_error(source_ + ": found sr " + std::to_string(csoundGetSr(csound)) + ", nchnls " +
                                 std::to_string(csoundGetNchnls(csound)) + ", 0dbfs " +
                                 std::to_string(csoundGet0dBFS(csound)) + ", expected 48000, 2 or 4, 1");
    }
}

double CsoundEngine::instrument_number(const std::string& name) {
    const double number = csoundEvalCode(csound_.get(), ("return nstrnum(\"" + name + "\")\n").c_str());
    if (!(number > 0)) throw std::runtime_error(source_ + ": found no `instr " + name + "`, expected one");
    return number;
}

std::span<double> CsoundEngine::table(int number) {
    MYFLT* values = nullptr;
    const int length = csoundGetTable(csound_.get(), &values, number);
    if (length <= 0 || values == nullptr) {
        throw std::runtime_error(source_ + ": found no function table " + std::to_string(number) +
                                 ", expected one");
    }
    return {values, static_cast<std::size_t>(length)};
}

void CsoundEngine::make_table(int number, std::span<const float> values) {
    const std::string code = "imade ftgen " + std::to_string(number) + ", 0, -" +
                             std::to_string(values.size()) + ", -2, 0\nreturn imade\n";
    if (csoundEvalCode(csound_.get(), code.c_str()) != number) failed_ = true;
    check_messages();
    std::ranges::copy(values, table(number).begin());
}

void CsoundEngine::start_note(std::span<const double> p_fields) {
    if (csoundScoreEvent(csound_.get(), 'i', p_fields.data(), static_cast<long>(p_fields.size())) != 0) {
        failed_ = true;
    }
}

std::span<const double> CsoundEngine::render_block() {
    messages_.clear();
    if (csoundPerformKsmps(csound_.get()) != 0) failed_ = true;
    check_messages();
    return {csoundGetSpout(csound_.get()), channels_ * static_cast<std::size_t>(block_size_)};
}

std::string CsoundEngine::version() {
    const int version = csoundGetVersion();
    return "Csound " + std::to_string(version / 1000) + "." + std::to_string(version / 10 % 100) + "." +
           std::to_string(version % 10);
}

}  // namespace audio
