#include <stdexcept>

#include "bullet_peer.h"

namespace sim_bench {

struct BulletWorld::Implementation {};

BulletWorld::BulletWorld(const sim::WorldDefinition&, BulletKind) {
    throw std::runtime_error(
        "error: found no Bullet in this build, expected one; install libbullet-dev and build again");
}
BulletWorld::~BulletWorld() = default;
BulletWorld::BulletWorld(BulletWorld&&) noexcept = default;
BulletWorld& BulletWorld::operator=(BulletWorld&&) noexcept = default;
void BulletWorld::step() {}
Eigen::Vector3d BulletWorld::position(int) const {
    return Eigen::Vector3d::Zero();
}

bool bullet_is_there() noexcept {
    return false;
}
std::string bullet_version() {
    return {};
}

}  // namespace sim_bench
