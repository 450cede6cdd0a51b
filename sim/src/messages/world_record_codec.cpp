#include "messages/world_record_codec.h"

#include "body/body_kind.h"
#include "bytes/archives.h"

namespace sim {
namespace {

constexpr double kFurthest = 1e7, kFastest = 1e6;  // m, m/s: as World quarantines

}  // namespace

std::uint32_t body_and_modes(std::uint32_t body, Eigen::Index modes) {
    if (body >= kMostWorldBodies || modes > kMostModes)
        throw std::invalid_argument("body " + std::to_string(body) + " with " + std::to_string(modes) +
                                    " modes: messages hold bodies below 2^24, 128 modes");
    return body | static_cast<std::uint32_t>(modes) << 24;
}

BodyAndModes parted(std::uint32_t both) {
    const BodyAndModes which{both & (kMostWorldBodies - 1), static_cast<int>(both >> 24)};
    if (which.modes > kMostModes)
        throw DecodeError(std::to_string(which.modes) + " modes, expected 0 to 128");
    return which;
}

bool is_broken(const WorldBodyState& s) {
    const double turn = s.orientation.squaredNorm();
    const bool whole = s.position.cwiseAbs().maxCoeff() <= kFurthest && s.position.allFinite() &&
                       s.velocity.cwiseAbs().maxCoeff() <= kFastest && s.velocity.allFinite() && turn > 0.5 &&
                       turn < 2 && s.angular_momentum.allFinite() && s.q.allFinite() && s.q_dot.allFinite();
    return !whole;
}

WorldBodyState stand_in(Eigen::Index modes) {
    const Eigen::Vector3d none = Eigen::Vector3d::Zero();
    const Eigen::VectorXd still = Eigen::VectorXd::Zero(modes);
    return {none, Eigen::Quaterniond::Identity(), none, none, still, still};
}

void write(ByteWriter& out, const std::vector<WorldRecord>& records) {
    write_fields(out, records);
}

std::vector<WorldRecord> read_world_records(ByteReader& in) {
    std::vector<WorldRecord> records;
    read_fields(in, records);
    return records;
}

}  // namespace sim
