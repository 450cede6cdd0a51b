#include "workers/listening_socket.h"

#include <fcntl.h>
#include <linux/filter.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstring>

namespace sim {
namespace {

constexpr int kMostConnections = 1000;
constexpr const char* kMonitor = "inproc://listening";

/// The lowest descriptor that is free in this process. So many at least are open. New descriptors take the
/// lowest number, so none gets a higher one than this.
int lowest_free(int descriptor) noexcept {
    const int free = fcntl(descriptor, F_DUPFD_CLOEXEC, 0);
    if (free >= 0) close(free);
    return free;
}

}  // namespace

ListeningSocket::ListeningSocket(zmq::context_t& context, zmq::socket_t& socket,
                                 const std::string& endpoint) {
    zmq::socket_t monitor(context, zmq::socket_type::pair);
    monitor.set(zmq::sockopt::linger, 0);
    (void)zmq_socket_monitor(socket.handle(), kMonitor, ZMQ_EVENT_LISTENING);
    monitor.connect(kMonitor);
    const auto stop = [&socket] { (void)zmq_socket_monitor(socket.handle(), nullptr, 0); };
    try {
        socket.bind(endpoint);
    } catch (const zmq::error_t&) {
        stop();
        throw;
    }
    zmq::message_t event;  // u16 event, i32 descriptor; it was sent within bind()
    if (monitor.recv(event, zmq::recv_flags::dontwait) && event.size() == 2 + sizeof descriptor_)
        std::memcpy(&descriptor_, event.data<std::uint8_t>() + 2, sizeof descriptor_);
    stop();
    rlimit limit{};
    const int open = lowest_free(descriptor_);
    if (open < 0 || getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
    const auto most = static_cast<int>(std::min<rlim_t>(limit.rlim_cur, 1 << 30));
    most_ = open + std::clamp((most - open) / 2, 0, kMostConnections);
}

void ListeningSocket::update() noexcept {
    if (descriptor_ < 0) return;
    const int free = lowest_free(descriptor_);
    const bool close = free < 0 || free >= most_;
    if (close == closed_) return;
    sock_filter nothing{BPF_RET | BPF_K, 0, 0, 0};
    const sock_fprog filter{1, &nothing};
    const int none = 0;
    const int done = close ? setsockopt(descriptor_, SOL_SOCKET, SO_ATTACH_FILTER, &filter, sizeof filter)
                           : setsockopt(descriptor_, SOL_SOCKET, SO_DETACH_FILTER, &none, sizeof none);
    if (done == 0) closed_ = close;
}

}  // namespace sim
