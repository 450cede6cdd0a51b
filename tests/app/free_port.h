#pragma once
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

namespace app {

/// A UDP port that was free just now.
inline int free_udp_port() {
    const int descriptor = socket(AF_INET6, SOCK_DGRAM, 0);
    sockaddr_in6 address{};
    address.sin6_family = AF_INET6;
    socklen_t size = sizeof address;
    (void)bind(descriptor, reinterpret_cast<sockaddr*>(&address), size);
    (void)getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
    close(descriptor);
    return ntohs(address.sin6_port);
}

}  // namespace app
