#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include "messages/worker_messages.h"
#include "sim/distributed_world.h"

namespace sim {
namespace {

/// FNV-1a 64.
class Hash {
public:
    void add(std::string_view bytes) {
        for (const char c : bytes) value_ = (value_ ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
    }
    template <typename Number>
    void add(Number number) {
        char bytes[sizeof number];
        std::memcpy(bytes, &number, sizeof number);
        add(std::string_view(bytes, sizeof number));
    }
    [[nodiscard]] std::uint64_t value() const { return value_; }

private:
    std::uint64_t value_ = 0xcbf29ce484222325u;
};

/// The last bits of what the mathematics library and the processor make of a few numbers.
void add_libm(Hash& hash) {
    for (int i = 1; i <= 64; ++i) {
        const double x = 0.37 * i + 1e-3;
        for (const double y : {std::sin(x), std::cos(x), std::exp(-x), std::log(x), std::pow(x, 1.7),
                               std::sqrt(x), std::atan2(x, 3), std::acos(1 / (1 + x)), std::cbrt(x)})
            hash.add(y);
        hash.add(std::sin(static_cast<float>(x)));
        hash.add(std::pow(static_cast<float>(x), 1.7f));
    }
}

/// Two soft bodies that fall onto the floor and each other.
std::uint64_t small_world() {
    WorldDefinition world;
    world.planes.push_back({});
    for (int i = 0; i < 2; ++i) {
        WorldBody body;
        body.name = "probe";
        body.shape.base = {{0.5, 0.4 + 0.1 * i, 0.6}, 0.8, 1.2};
        body.material = {1e5, 0.3, 100};
        body.fidelity.fidelity = Fidelity::modal;
        body.world_from_body.translation() = Eigen::Vector3d(0.1 * i, 0.5 + i, 0);
        body.angular_velocity = {1, 2, 3};
        world.bodies.push_back(body);
    }
    World probe(world);
    for (int i = 0; i < 30; ++i) probe.step();
    return probe.state_hash();
}

}  // namespace

std::uint64_t step_fingerprint() {
    static const std::uint64_t fingerprint = [] {
        Hash hash;
        hash.add(std::string_view(__VERSION__));
        hash.add(kProtocol);
#ifdef MUSICWORLD_BASELINE
        hash.add(std::string_view("x86-64"));
#else
        hash.add(std::string_view("x86-64-v3"));
#endif
        add_libm(hash);
        hash.add(small_world());
        if (const char* other = std::getenv("MUSICWORLD_OTHER_FINGERPRINT"))  // for tests of its refusal
            hash.add(std::string_view(other));
        return hash.value();
    }();
    return fingerprint;
}

}  // namespace sim
