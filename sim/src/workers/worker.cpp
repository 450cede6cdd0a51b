#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <span>
#include <utility>

#include "messages/worker_messages.h"
#include "sim/distributed_world.h"
#include "sim/errors.h"
#include "struck/stepped_body.h"
#include "workers/heartbeat.h"
#include "workers/signals.h"
#include "workers/socket_folder.h"
#include "workers/worker_process.h"
#include "workers/world_service.h"

namespace sim {
namespace {

using namespace std::chrono_literals;
constexpr auto kAnswerWithin = 10s, kLeaveWithin = 1s;
constexpr int kLookMs = 100, kLingerMs = 500;

void send(zmq::socket_t& socket, const std::vector<std::uint8_t>& bytes) {
    (void)socket.send(zmq::buffer(bytes), zmq::send_flags::none);
}

std::span<const std::uint8_t> bytes_of(const zmq::message_t& frame) {
    return {frame.data<std::uint8_t>(), frame.size()};
}

/// Returns false if no message comes for a while.
bool receive(zmq::socket_t& socket, zmq::message_t& frame) {
    try {
        return socket.recv(frame).has_value();
    } catch (const zmq::error_t& e) {
        if (e.num() == EINTR) return false;
        throw;
    }
}

/// A worker of a play, see StruckWorkers.
class KitWorker {
public:
    KitWorker(zmq::socket_t& socket, const Heartbeat& heartbeat) : socket_(socket), heartbeat_(heartbeat) {}

    /// `first`: the answer to the request to join. Returns 0 at the end of the play, 1 when the application
    /// is gone.
    int serve(DecodedMessage&& first) {
        WorkerMessage message = std::move(first.message);
        zmq::message_t frame;
        do {
            if (std::holds_alternative<EndOfRun>(message)) return 0;
            std::visit([this](const auto& m) { handle(m); }, message);
            while (!heartbeat_.application_gone() && !receive(socket_, frame)) {
            }
            if (!heartbeat_.application_gone()) message = decode_message(bytes_of(frame)).message;
        } while (!heartbeat_.application_gone());
        return 1;
    }

private:
    void handle(const StruckAssign& assign) {
        for (const StruckAssignment& a : assign.bodies)
            bodies_.insert_or_assign(a.body, SteppedBody(a.body, a.definition, a.record));
    }
    void handle(const StruckStep& step) {
        StruckAnswer answer{step.epoch, step.step, std::vector<BodyOutcome>(step.bodies.size())};
        for (std::size_t i = 0; i < step.bodies.size(); ++i) {
            const auto found = bodies_.find(step.bodies[i]);
            if (found == bodies_.end())
                throw DecodeError("a step of body " + std::to_string(step.bodies[i]) + ", not assigned");
            found->second.step(step.request, answer.outcomes[i]);
        }
        send(socket_, encode({}, answer));
    }
    void handle(const Beat&) {}
    template <typename Other>
    void handle(const Other&) {
        throw DecodeError("a message that no worker of a play gets");
    }

    zmq::socket_t& socket_;
    const Heartbeat& heartbeat_;
    std::map<std::uint32_t, SteppedBody> bodies_;
};

/// Waits for the application's answer to the request to join. Once the worker is asked to leave it waits only
/// for an answer that may be under way.
bool wait_for_answer(zmq::socket_t& socket, const Heartbeat& heartbeat, zmq::message_t& frame) {
    auto until = std::chrono::steady_clock::now() + kAnswerWithin;
    bool leaving = false;
    while (!heartbeat.application_gone() && std::chrono::steady_clock::now() < until) {
        if (receive(socket, frame)) return true;
        if (leave_asked() && !std::exchange(leaving, true))
            until = std::min(until, std::chrono::steady_clock::now() + kLeaveWithin);
    }
    return false;
}

/// From the process that started this one, or a new one.
Secret own_secret() {
    const char* given = std::getenv(kSecretVariable);
    const std::optional<Secret> secret = from_hex(given ? given : "");
    return secret ? *secret : make_secret();
}

std::vector<std::uint8_t> join_request(const Secret& secret) {
    std::array<char, 256> host{};
    gethostname(host.data(), host.size() - 1);
    return encode(MessageHeader{}, JoinRequest{secret, host.data()});
}

/// Serves a world or a play, by the application's first answer.
int serve(zmq::socket_t& socket, Heartbeat& heartbeat, int threads, DecodedMessage&& first) {
    if (const auto* scene = std::get_if<SceneMessage>(&first.message))
        return serve_world(socket, heartbeat, threads, *scene);
    if (std::holds_alternative<StruckAssign>(first.message)) {
        heartbeat.joined(first.header.worker);
        stop_listening_for_leave();
        try {
            return KitWorker(socket, heartbeat).serve(std::move(first));
        } catch (const DecodeError& e) {
            send(socket, encode({}, WorkerFailure{e.what()}));
            throw;
        }
    }
    if (const auto* refusal = std::get_if<Refusal>(&first.message))
        std::fprintf(stderr, "worker: refused: %s\n", refusal->why.c_str());
    return std::holds_alternative<EndOfRun>(first.message) ? 0 : 1;
}

// ZeroMQ does not say which of these is the case.
std::string keys_may_be_wrong(bool with_key) {
    return with_key ? ": nobody listens there, without or with other keys, or it does not allow this one"
                    : ": nobody listens there, or only to workers with keys (--key)";
}

int serve(zmq::context_t& context, const std::string& endpoint, const std::optional<WorkerKeys>& keys,
          int threads) {
    zmq::socket_t socket = connect_worker(context, endpoint, keys, kLingerMs);
    socket.set(zmq::sockopt::rcvtimeo, kLookMs);
    const Secret secret = own_secret();
    Heartbeat heartbeat(context, endpoint, keys, secret);
    listen_for_leave();  // from the request to join on the worker leaves in order
    send(socket, join_request(secret));
    zmq::message_t frame;
    int status = 1;
    if (wait_for_answer(socket, heartbeat, frame)) {
        status = serve(socket, heartbeat, threads, decode_message(bytes_of(frame)));
    } else if (leave_asked()) {
        stop_listening_for_leave();
    } else if (!heartbeat.application_gone()) {
        throw WorkerError("no answer from " + endpoint + " within 10 s" +
                          (endpoint.starts_with("tcp") ? keys_may_be_wrong(keys.has_value()) : ""));
    }
    if (status != 0 && heartbeat.application_gone()) {
        std::fprintf(stderr, "worker: the application is gone, or has given this worker up\n");
        remove_left_socket(endpoint);
    }
    return status;
}

}  // namespace

int run_worker(const std::string& endpoint, const std::filesystem::path& key, int threads) {
    std::optional<WorkerKeys> keys;
    if (!key.empty()) keys = read_worker_keys(key);
    check_endpoint(endpoint, keys.has_value());
    try {
        zmq::context_t context;
        return serve(context, endpoint, keys, threads);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "worker: %s\n", e.what());
    }
    return 1;
}

}  // namespace sim
