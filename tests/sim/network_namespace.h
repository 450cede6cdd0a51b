#pragma once
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <stdexcept>
#include <string>

#include "sim/simulation.h"

namespace sim_test {

/// Another host for the tests: a network namespace with one cable to this one. Goes away at the end.
class OtherHost {
public:
    /// Whether this machine lets us make one.
    [[nodiscard]] static bool possible() {
        const std::string probe = "mwprobe" + std::to_string(getpid());
        return run("ip netns add " + probe) && run("ip netns del " + probe);
    }

    explicit OtherHost(int number)
        : name_("mw" + std::to_string(getpid()) + "n" + std::to_string(number)),
          net_("10." + std::to_string(200 + getpid() % 50) + "." + std::to_string(number) + ".") {
        const bool made = run("ip netns add " + name_) &&
                          run("ip link add " + cable() + " type veth peer name eth0 netns " + name_) &&
                          run("ip addr add " + here() + "/24 dev " + cable()) &&
                          run("ip link set " + cable() + " up") &&
                          run("ip -n " + name_ + " addr add " + net_ + "2/24 dev eth0") &&
                          run("ip -n " + name_ + " link set eth0 up");
        if (!made) {
            remove();
            throw std::runtime_error("no network namespace");
        }
    }
    ~OtherHost() { remove(); }
    OtherHost(const OtherHost&) = delete;
    OtherHost& operator=(const OtherHost&) = delete;

    [[nodiscard]] std::string here() const { return net_ + "1"; }  ///< this machine's address for it
    void cut() const { run("ip link set " + cable() + " down"); }
    /// The same program, there.
    [[nodiscard]] sim::WorkerLaunch there(const sim::WorkerLaunch& launch) const {
        sim::WorkerLaunch other = {"/usr/bin/env", {"ip", "netns", "exec", name_, launch.program}, 1};
        other.arguments.insert(other.arguments.end(), launch.arguments.begin(), launch.arguments.end());
        return other;
    }

private:
    [[nodiscard]] std::string cable() const { return name_.substr(0, 15); }
    void remove() const {
        run("ip link del " + cable());  // a namespace's own are removed some time after it
        run("ip netns del " + name_);
    }
    static bool run(const std::string& command) {
        return std::system((command + " >/dev/null 2>&1").c_str()) == 0;  // NOLINT(cert-env33-c)
    }
    const std::string name_, net_;
};

}  // namespace sim_test
