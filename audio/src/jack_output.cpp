#include "jack_output.h"

#include <jack/midiport.h>
#include <pthread.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <stdexcept>
#include <vector>

#include "audio/performance.h"
#include "clocks.h"

namespace audio {
namespace {

constexpr double kRoomToCompute_s = 0.001;
constexpr std::int64_t kPatienceNs = 100'000'000;

std::string in_ms(double seconds) {
    std::string text = std::to_string(1e3 * seconds);
    return text.substr(0, text.find('.') + 2) + " ms";
}

std::string server_name() {
    const char* name = std::getenv("JACK_DEFAULT_SERVER");  // NOLINT: read once, before our threads start
    return name != nullptr ? std::string(" `") + name + "`" : "";
}

jack_client_t* open_client() {
    jack_set_error_function([](const char*) {});  // the process's: JACK writes of its own accord otherwise
    jack_set_info_function([](const char*) {});
    jack_status_t status{};
    jack_client_t* client = jack_client_open("musicworld", JackNoStartServer, &status);
    if (client != nullptr) return client;
    throw std::runtime_error("JACK: no server" + server_name() +
                             " is running; start it (jackd -d alsa -r 48000 -p 128) or leave the option out");
}

jack_port_t* open_port(jack_client_t* client, const std::string& name, const char* type,
                       JackPortFlags direction = JackPortIsOutput) {
    jack_port_t* port = jack_port_register(client, name.c_str(), type, direction, 0);
    if (port != nullptr) return port;
    throw std::runtime_error("JACK: cannot make the port `" + name +
                             "`; choose a name that is new and short");
}

/// The first two physical outputs for sound; fewer where there are fewer.
std::vector<std::string> physical_outputs(jack_client_t* client) {
    const char** ports =
        jack_get_ports(client, nullptr, JACK_DEFAULT_AUDIO_TYPE, JackPortIsPhysical | JackPortIsInput);
    std::vector<std::string> names;
    for (int i = 0; ports != nullptr && ports[i] != nullptr && i < 2; ++i) names.emplace_back(ports[i]);
    jack_free(static_cast<void*>(ports));
    return names;
}

}  // namespace

JackOutput::JackOutput(const Options& options) : client_(open_client()) {
    jack_client_t* client = client_.get();
    check_timing(options);
    open_ports(options);
    jack_set_process_callback(client, &JackOutput::process, this);
    jack_on_shutdown(client, &JackOutput::server_ended, this);
    if (jack_activate(client) != 0) {
        throw std::runtime_error(
            "JACK: found a server that does not start our client, expected one that does; see its log");
    }
    connect(options);
}

JackOutput::~JackOutput() = default;

void JackOutput::check_timing(const Options& options) const {
    const jack_nframes_t rate = jack_get_sample_rate(client_.get());
    if (rate != static_cast<jack_nframes_t>(kSampleRate)) {
        throw std::runtime_error("JACK: found a server at " + std::to_string(rate) +
                                 " Hz, expected 48000 Hz; start it with -r 48000");
    }
    const jack_nframes_t period = jack_get_buffer_size(client_.get());
    const double period_s = static_cast<double>(period) / kSampleRate;
    const double needed_s = period_s + kRoomToCompute_s;
    if (needed_s > options.output_lead_s) {
        throw std::runtime_error(
            "JACK: found a period of " + std::to_string(period) + " frames (" + in_ms(period_s) +
            "), expected one that with 1 ms to compute fits in the output lead of " +
            in_ms(options.output_lead_s) + "; start jackd with a smaller -p (128), or raise the lead to " +
            in_ms(needed_s + 0.0001) + " or more");
    }
}

void JackOutput::open_ports(const Options& options) {
    if (options.sound) {
        left_ = open_port(client_.get(), "out_l", JACK_DEFAULT_AUDIO_TYPE);
        right_ = open_port(client_.get(), "out_r", JACK_DEFAULT_AUDIO_TYPE);
    }
    if (!options.midi_port.empty())
        midi_ = open_port(client_.get(), options.midi_port, JACK_DEFAULT_MIDI_TYPE);
    const bool elsewhere = options.midi_input.find(':') != std::string::npos;
    if (!options.midi_input.empty())
        midi_input_ = open_port(client_.get(), elsewhere ? "midi_in" : options.midi_input,
                                JACK_DEFAULT_MIDI_TYPE, JackPortIsInput);
}

void JackOutput::connect(const Options& options) {
    description_ = "JACK" + server_name() + " at 48000 Hz, periods of " +
                   std::to_string(jack_get_buffer_size(client_.get())) + " frames";
    if (left_ != nullptr) connect_sound();
    if (midi_ != nullptr) connect_midi(options.midi_connect);
    if (midi_input_ != nullptr) connect_midi_input(options.midi_input);
}

void JackOutput::connect_sound() {
    const std::vector<std::string> outputs = physical_outputs(client_.get());
    const std::array ports{left_, right_};
    std::string connected;
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        if (jack_connect(client_.get(), jack_port_name(ports[i]), outputs[i].c_str()) != 0) continue;
        connected += (connected.empty() ? " -> " : ", ") + outputs[i];
    }
    description_ += std::string("; sound ") + jack_port_name(left_) + ", " + jack_port_name(right_) +
                    (connected.empty() ? " (not connected: no physical outputs)" : connected);
}

/// What is played on is there from the beginning: unlike a receiver, a sender that is missing is an error.
void JackOutput::connect_midi_input(const std::string& peer) {
    description_ += std::string("; MIDI from ") + jack_port_name(midi_input_);
    if (peer.find(':') == std::string::npos) return;
    if (jack_connect(client_.get(), peer.c_str(), jack_port_name(midi_input_)) != 0)
        throw std::runtime_error("JACK: found no port `" + peer +
                                 "` to listen to, expected a MIDI output that is there before this starts "
                                 "(jack_lsp -t lists them)");
    description_ += " <- " + peer;
}

void JackOutput::connect_midi(const std::string& peer) {
    description_ += std::string("; MIDI ") + jack_port_name(midi_);
    if (peer.empty()) return;
    const bool connected = jack_connect(client_.get(), jack_port_name(midi_), peer.c_str()) == 0;
    description_ += connected ? " -> " + peer : " (not connected)";
    if (connected) return;
    midi_problem_ = "JACK: found no port `" + peer +
                    "` to connect to, expected a MIDI input that is there before this starts (jack_lsp -t "
                    "lists them); `" +
                    jack_port_name(midi_) + "` stays open";
}

void JackOutput::start(std::span<float> ring, std::int64_t epoch_ns) noexcept {
    ring_.start(ring);
    epoch_ns_ = epoch_ns;
    sounding_.store(true, std::memory_order_seq_cst);
}

bool JackOutput::send(const MidiStroke& stroke) noexcept {
    if (midi_ == nullptr || ended_.load(std::memory_order_relaxed)) return false;
    if (!strokes_.try_push(stroke)) {
        lost_strokes_.fetch_add(1, std::memory_order_relaxed);
        return false;
    }
    last_due_ns_ = std::max(last_due_ns_, stroke.due_ns);
    return true;
}

void JackOutput::stop() noexcept {
    leave_ring();
    if (last_due_ns_ == 0 || ended_.load(std::memory_order_relaxed)) return;
    const std::int64_t period_ns = samples_ns(jack_get_buffer_size(client_.get()));
    sleep_until_ns(last_due_ns_ + MidiEvents::kLengthNs + 2 * period_ns);
}

/// A cycle may never end: a server that goes away can take JACK's thread with it.
void JackOutput::leave_ring() noexcept {
    sounding_.store(false, std::memory_order_seq_cst);
    const std::int64_t until = monotonic_ns() + kPatienceNs;
    while (in_cycle_.load(std::memory_order_seq_cst)) {
        if (ended_.load(std::memory_order_relaxed) || monotonic_ns() > until) return;
        sleep_until_ns(monotonic_ns() + 100'000);
    }
}

std::string JackOutput::description() const {
    return description_ + (ended_.load(std::memory_order_relaxed) ? " (the server ended)" : "");
}

DeviceCounts JackOutput::counts() const noexcept {
    return {underruns_.load(std::memory_order_relaxed), corrections_.load(std::memory_order_relaxed),
            late_strokes_.load(std::memory_order_relaxed), lost_strokes_.load(std::memory_order_relaxed)};
}

void JackOutput::server_ended(void* self) {
    static_cast<JackOutput*>(self)->ended_.store(true, std::memory_order_relaxed);
}

// JACK ends its thread by cancelling it, at any instruction. Unwound through a cycle, that would end the program.
int JackOutput::process(jack_nframes_t frames, void* self) {
    int before = PTHREAD_CANCEL_ENABLE;
    pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &before);
    static_cast<JackOutput*>(self)->run_cycle(frames);
    pthread_setcancelstate(before, nullptr);
    return 0;
}

void JackOutput::run_cycle(jack_nframes_t frames) noexcept {
    measure_clock();
    const Cycle cycle = this_cycle(frames);
    if (left_ != nullptr) play(cycle);
    if (midi_ != nullptr) send_strokes(cycle);
    if (midi_input_ != nullptr) receive(cycle);
    expected_frame_ = cycle.first_frame + frames;
}

/// JACK smooths its cycles' times over a second or so; after a hold-up they lag far behind. A cycle runs
/// within a period of its begin, so what it says is kept within that.
JackOutput::Cycle JackOutput::this_cycle(jack_nframes_t frames) const noexcept {
    const jack_nframes_t first = jack_last_frame_time(client_.get());
    const std::int64_t now = monotonic_ns();
    const std::int64_t begin =
        1000 * static_cast<std::int64_t>(jack_frames_to_time(client_.get(), first)) + jack_zero_ns_;
    return {.first_frame = first,
            .frames = static_cast<std::int32_t>(frames),
            .begin_ns = std::clamp(begin, now - samples_ns(frames), now),
            .continuous = first == expected_frame_};
}

/// A reading that something came between is left out.
void JackOutput::measure_clock() noexcept {
    const std::int64_t before = monotonic_ns();
    const std::int64_t jack_ns = 1000 * static_cast<std::int64_t>(jack_get_time());
    const std::int64_t after = monotonic_ns();
    if (jack_zero_ns_ == 0 || after - before < 5000) jack_zero_ns_ = before + (after - before) / 2 - jack_ns;
}

void JackOutput::play(const Cycle& cycle) noexcept {
    const auto frames = static_cast<jack_nframes_t>(cycle.frames);
    auto* left = static_cast<float*>(jack_port_get_buffer(left_, frames));
    auto* right = static_cast<float*>(jack_port_get_buffer(right_, frames));
    in_cycle_.store(true, std::memory_order_seq_cst);
    if (sounding_.load(std::memory_order_seq_cst)) {
        const double due = static_cast<double>(cycle.begin_ns - epoch_ns_) * kSampleRate * 1e-9;
        const std::int64_t first = position_.begin_cycle(due, cycle.frames, playing_ && cycle.continuous);
        const bool there = ring_.read(
            first, cycle.frames,
            [&](std::int32_t i, float at_left, float at_right) { left[i] = at_left, right[i] = at_right; });
        if (!there) underruns_.fetch_add(1, std::memory_order_relaxed);
        corrections_.store(position_.corrections(), std::memory_order_relaxed);
        playing_ = true;
    } else {
        std::fill_n(left, frames, 0.0F);
        std::fill_n(right, frames, 0.0F);
    }
    in_cycle_.store(false, std::memory_order_seq_cst);
}

/// Messages of three bytes, a status and data; others (clocks, system exclusive, what is damaged) are left out. Until
/// somebody takes them the newest are held, as what matters is where a pedal is.
void JackOutput::receive(const Cycle& cycle) noexcept {
    void* buffer = jack_port_get_buffer(midi_input_, static_cast<jack_nframes_t>(cycle.frames));
    const bool taken = taken_.load(std::memory_order_relaxed);
    if (taken) release_early();
    const std::uint32_t count = jack_midi_get_event_count(buffer);
    for (std::uint32_t i = 0; i < count; ++i) {
        jack_midi_event_t event{};
        if (jack_midi_event_get(&event, buffer, i) != 0) continue;
        if (!is_message({event.buffer, event.size})) continue;
        const std::int64_t at_ns = cycle.begin_ns + samples_ns(event.time);
        const MidiMessage message{static_cast<double>(at_ns) * 1e-9, event.buffer[0], event.buffer[1],
                                  event.buffer[2]};
        if (taken) {
            (void)received_.try_push(message);
        } else {
            early_[early_count_++ % early_.size()] = message;
        }
    }
}

void JackOutput::release_early() noexcept {
    const std::size_t size = early_.size();
    for (std::size_t i = early_count_ - std::min(early_count_, size); i < early_count_; ++i)
        (void)received_.try_push(early_[i % size]);
    early_count_ = 0;
}

void JackOutput::send_strokes(const Cycle& cycle) noexcept {
    void* buffer = jack_port_get_buffer(midi_, static_cast<jack_nframes_t>(cycle.frames));
    jack_midi_clear_buffer(buffer);
    MidiStroke stroke;
    while (strokes_.try_pop(stroke)) {
        if (!events_.add(stroke)) lost_strokes_.fetch_add(1, std::memory_order_relaxed);
    }
    for (; !events_.empty(); events_.pop_front()) {
        const MidiEvent& event = events_.front();
        const std::int64_t frame = ns_samples(event.due_ns - cycle.begin_ns);
        if (frame >= cycle.frames) return;
        const auto at = static_cast<jack_nframes_t>(std::max<std::int64_t>(frame, 0));
        if (jack_midi_event_write(buffer, at, event.bytes.data(), event.bytes.size()) != 0) return;  // full
        if (frame < 0 && event.is_note_on()) late_strokes_.fetch_add(1, std::memory_order_relaxed);
    }
}

}  // namespace audio
