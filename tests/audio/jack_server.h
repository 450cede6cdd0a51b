#pragma once
#include <jack/jack.h>
#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

/// A JACK server without a device, for one test, and what listens to it.
namespace jack_server {

/// A program found in PATH, and run until this ends.
class Program {
public:
    [[nodiscard]] static bool is_installed(const std::string& name);
    explicit Program(std::vector<std::string> arguments);
    ~Program();
    Program(const Program&) = delete;
    Program& operator=(const Program&) = delete;
    void start_again_if_ended();
    void terminate();  ///< and waits
    void kill();

private:
    void start();
    void end(int signal);
    std::vector<std::string> arguments_;
    pid_t pid_ = -1;
};

/// jackd with its dummy driver, under a name of the tests' own, which is the default one meanwhile; one at
/// a time, whatever runs the tests.
class Server {
public:
    explicit Server(int period = 128, int rate = 48000);
    ~Server();
    Server(const Server&) = delete;
    Server& operator=(const Server&) = delete;
    [[nodiscard]] bool is_up() const { return up_; }
    void end() { jackd_.terminate(); }

private:
    int lock_ = -1;  // one server at a time
    Program jackd_;
    bool up_ = false;
};

/// A note-on or note-off that came.
struct Received {
    std::int64_t at_ns = 0;    ///< of CLOCK_MONOTONIC, by the frame it came in
    std::int64_t seen_ns = 0;  ///< when the cycle ran
    std::uint8_t bytes[3] = {};
};

/// One cycle of sound.
struct Cycle {
    std::int64_t at_ns = 0;  ///< when its first frame is due
    std::size_t first = 0;   ///< its place in the sound heard
    std::int64_t frame = 0;  ///< JACK's count
};

/// A client that records what comes: two channels of sound, and MIDI. Room for 30 s.
class Listener {
public:
    Listener();
    ~Listener();
    Listener(const Listener&) = delete;
    Listener& operator=(const Listener&) = delete;

    /// Waits up to 10 s until both ports are there; false where they are not.
    bool connect(const std::string& from, const std::string& to);
    /// Ends listening; then what came may be read.
    void stop();
    [[nodiscard]] const std::vector<float>& left() const { return left_; }
    [[nodiscard]] const std::vector<float>& right() const { return right_; }
    [[nodiscard]] const std::vector<Cycle>& cycles() const { return cycles_; }
    [[nodiscard]] const std::vector<Received>& received() const { return received_; }
    /// Cycles that the server told it did not finish. What was sent in one may be lost, or come twice: a client that JACK did
    /// not wait for leaves its old buffer to the receiver.
    [[nodiscard]] int xruns() const { return xruns_.load(); }

private:
    static int process(jack_nframes_t frames, void* self);
    void listen(jack_nframes_t frames);

    jack_client_t* client_ = nullptr;
    jack_port_t *in_l_ = nullptr, *in_r_ = nullptr, *midi_ = nullptr;
    std::vector<float> left_, right_;
    std::vector<Cycle> cycles_;
    std::vector<Received> received_;
    std::atomic<int> xruns_ = 0;
};

}  // namespace jack_server
