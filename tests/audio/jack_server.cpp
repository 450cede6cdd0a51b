#include "jack_server.h"

#include <fcntl.h>
#include <jack/midiport.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <sstream>
#include <thread>

#include "clocks.h"

namespace jack_server {
namespace {

constexpr std::size_t kRoom = 30 * 48000;

// Always the same: JACK keeps one of its eight places for a server that was killed until its name comes
// again.
std::string own_name() {
    return "musicworld-test-" + std::to_string(getuid());
}

/// Waits until no other process of ours has a server.
int lock_name() {
    const int lock = open(("/tmp/" + own_name() + ".lock").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
    if (lock >= 0) flock(lock, LOCK_EX);
    return lock;
}

void pause_ms(int ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

jack_client_t* open_client(const char* name) {
    jack_set_error_function([](const char*) {});
    jack_set_info_function([](const char*) {});
    return jack_client_open(name, JackNoStartServer, nullptr);
}

}  // namespace

bool Program::is_installed(const std::string& name) {
    std::istringstream folders(std::getenv("PATH"));
    for (std::string folder; std::getline(folders, folder, ':');) {
        if (access((folder + "/" + name).c_str(), X_OK) == 0) return true;
    }
    return false;
}

Program::Program(std::vector<std::string> arguments) : arguments_(std::move(arguments)) {
    // Ends with this process too, however that ends.
    arguments_.insert(arguments_.begin(), {"setpriv", "--pdeathsig", "KILL"});
    start();
}

void Program::start_again_if_ended() {
    if (pid_ >= 0 && waitpid(pid_, nullptr, WNOHANG) == pid_) start();
}

void Program::start() {
    std::vector<char*> pointers;
    for (std::string& argument : arguments_) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, 0, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
    posix_spawn_file_actions_adddup2(&actions, 1, 2);
    if (posix_spawnp(&pid_, pointers[0], &actions, nullptr, pointers.data(), environ) != 0) pid_ = -1;
    posix_spawn_file_actions_destroy(&actions);
}

Program::~Program() {
    end(SIGTERM);
}

void Program::terminate() {
    end(SIGTERM);
}

void Program::kill() {
    end(SIGKILL);
}

void Program::end(int signal) {
    if (pid_ < 0) return;
    ::kill(pid_, signal);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
}

Server::Server(int period, int rate)
    : lock_(lock_name()),
      jackd_({"jackd", "-r", "-m", "-n", own_name(), "-d", "dummy", "-r", std::to_string(rate), "-p",
              std::to_string(period)}) {
    setenv("JACK_DEFAULT_SERVER", own_name().c_str(), 1);
    // A server does not start beside what one that was killed has left; the next one does.
    for (int attempt = 0; attempt < 600 && !up_; ++attempt) {
        pause_ms(100);
        jackd_.start_again_if_ended();
        jack_client_t* client = open_client("probe");
        up_ = client != nullptr;
        if (up_) jack_client_close(client);
    }
}

Server::~Server() {
    unsetenv("JACK_DEFAULT_SERVER");
    jackd_.terminate();
    if (lock_ >= 0) close(lock_);
}

Listener::Listener() : client_(open_client("listener")) {
    left_.reserve(kRoom);
    right_.reserve(kRoom);
    cycles_.reserve(kRoom);
    received_.reserve(kRoom);
    if (client_ == nullptr) return;
    in_l_ = jack_port_register(client_, "in_l", JACK_DEFAULT_AUDIO_TYPE, JackPortIsInput, 0);
    in_r_ = jack_port_register(client_, "in_r", JACK_DEFAULT_AUDIO_TYPE, JackPortIsInput, 0);
    midi_ = jack_port_register(client_, "midi", JACK_DEFAULT_MIDI_TYPE, JackPortIsInput, 0);
    jack_set_process_callback(client_, &Listener::process, this);
    jack_set_xrun_callback(
        client_,
        [](void* self) {
            ++static_cast<Listener*>(self)->xruns_;
            return 0;
        },
        this);
    jack_activate(client_);
}

Listener::~Listener() {
    stop();
}

void Listener::stop() {
    if (client_ != nullptr) jack_client_close(client_);
    client_ = nullptr;
}

bool Listener::connect(const std::string& from, const std::string& to) {
    for (int attempt = 0; attempt < 100; ++attempt) {
        if (jack_port_by_name(client_, from.c_str()) != nullptr &&
            jack_port_by_name(client_, to.c_str()) != nullptr)
            return jack_connect(client_, from.c_str(), to.c_str()) == 0;
        pause_ms(100);
    }
    return false;
}

// As in JackOutput: JACK cancels its thread at any instruction.
int Listener::process(jack_nframes_t frames, void* self) {
    int before = PTHREAD_CANCEL_ENABLE;
    pthread_setcancelstate(PTHREAD_CANCEL_DISABLE, &before);
    static_cast<Listener*>(self)->listen(frames);
    pthread_setcancelstate(before, nullptr);
    return 0;
}

void Listener::listen(jack_nframes_t frames) {
    const std::int64_t now = audio::monotonic_ns();
    const std::int64_t zero = now - 1000 * static_cast<std::int64_t>(jack_get_time());
    const jack_nframes_t begin = jack_last_frame_time(client_);
    // After a hold-up JACK's own times lag for a second; a cycle runs within a period of its begin.
    const std::int64_t said = zero + 1000 * static_cast<std::int64_t>(jack_frames_to_time(client_, begin));
    const std::int64_t begin_ns = std::clamp(said, now - audio::samples_ns(frames), now);
    const auto at_ns = [&](jack_nframes_t offset) { return begin_ns + audio::samples_ns(offset); };
    void* midi = jack_port_get_buffer(midi_, frames);
    for (std::uint32_t i = 0; i < jack_midi_get_event_count(midi); ++i) {
        jack_midi_event_t event;
        if (jack_midi_event_get(&event, midi, i) != 0 || event.size != 3) continue;
        received_.push_back({at_ns(event.time), now, {event.buffer[0], event.buffer[1], event.buffer[2]}});
    }
    if (left_.size() + frames > kRoom) return;
    cycles_.push_back({at_ns(0), left_.size(), begin});
    const auto* l = static_cast<const float*>(jack_port_get_buffer(in_l_, frames));
    const auto* r = static_cast<const float*>(jack_port_get_buffer(in_r_, frames));
    left_.insert(left_.end(), l, l + frames);
    right_.insert(right_.end(), r, r + frames);
}

}  // namespace jack_server
