#include "tracking/known_motion.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "learned/learned_path.h"

namespace tracking {
namespace {

constexpr double kLeadS = 1.0 / 15, kMemoryS = 10, kLeastS = 0.4, kRatio = 0.65;
constexpr double kSlowest_mps = 0.3;  // below it errors are the sensor's
// Predictions are so far apart, and the velocity is over so much: between closer samples it is the sensor's noise.
constexpr double kApartS = 1.0 / 150;

}  // namespace

struct KnownMotion::State {
    /// Where the tracked point was expected to be.
    struct Expected {
        double due_s = 0;
        Eigen::Vector3d by_model = Eigen::Vector3d::Zero(), by_velocity = Eigen::Vector3d::Zero();
        bool moves = false;
    };

    State(const PathModel& model, const Eigen::Vector3d& shaft)
        : learned(model, shaft), ring(static_cast<std::size_t>(kLeadS / kApartS) + 2) {}

    void judge(const PoseSample& sample) noexcept;
    void expect(const PoseSample& sample) noexcept;

    Learned learned;
    double newest_s = 0, last_due_s = 0;
    Eigen::Vector3d newest = Eigen::Vector3d::Zero();
    double from_s = 0;  // of the last prediction's sample, from which the velocity is
    Eigen::Vector3d from = Eigen::Vector3d::Zero();
    std::vector<Expected> ring;
    std::size_t first = 0, count = 0;
    double judged_s = 0, model_square = 0, velocity_square = 0;  // [s], [m^2 s]
};

/// The truth is the path between the newest two samples.
void KnownMotion::State::judge(const PoseSample& sample) noexcept {
    for (; count > 0 && ring[first].due_s <= sample.t_s; first = (first + 1) % ring.size(), --count) {
        const Expected& e = ring[first];
        const double dt_s = std::clamp(e.due_s - last_due_s, 0.0, kGapS);
        last_due_s = e.due_s;
        if (!e.moves) continue;
        const double share = (e.due_s - newest_s) / (sample.t_s - newest_s),
                     kept = std::exp(-dt_s / kMemoryS);
        const Eigen::Vector3d truth = newest + share * (sample.position - newest);
        model_square = kept * model_square + dt_s * (e.by_model - truth).squaredNorm();
        velocity_square = kept * velocity_square + dt_s * (e.by_velocity - truth).squaredNorm();
        judged_s += dt_s;
    }
}

void KnownMotion::State::expect(const PoseSample& sample) noexcept {
    if (sample.t_s - from_s < kApartS || count == ring.size()) return;
    const Eigen::Vector3d velocity = (sample.position - from) / (sample.t_s - from_s);
    from_s = sample.t_s;
    from = sample.position;
    ring[(first + count++) % ring.size()] = {sample.t_s + kLeadS, learned.predict(kLeadS).position,
                                             sample.position + kLeadS * velocity,
                                             learned.path().frame().speed > kSlowest_mps};
}

KnownMotion::KnownMotion(const PathModel& model, const Eigen::Vector3d& shaft)
    : state_(std::make_unique<State>(model, shaft)) {}
KnownMotion::KnownMotion(KnownMotion&& other) noexcept = default;
KnownMotion& KnownMotion::operator=(KnownMotion&& other) noexcept = default;
KnownMotion::~KnownMotion() = default;

void KnownMotion::push(const PoseSample& sample) noexcept {
    State& s = *state_;
    const SampleStatus status = s.learned.correct(sample);
    if (!is_taken(status)) return;
    if (status == SampleStatus::reinitialised) {
        s.count = 0;
        s.last_due_s = sample.t_s + kLeadS;
        s.from_s = sample.t_s;
        s.from = sample.position;
    } else {
        s.judge(sample);
        s.expect(sample);
    }
    s.newest_s = sample.t_s;
    s.newest = sample.position;
}

bool KnownMotion::is_known() const noexcept {
    return state_->judged_s >= kLeastS && state_->model_square < kRatio * kRatio * state_->velocity_square;
}

}  // namespace tracking
