#include "outlier_gate.h"

#include <algorithm>

namespace tracking {
namespace {
constexpr int kPersisting = 3;
constexpr int kSettled = 2;  // measurements after the first until the speed is known
}  // namespace

bool OutlierGate::possible(const Surprise& s) const noexcept {
    if (s.displacement > fastest_ * s.dt) return false;
    const double explained = 2 * s.speed * s.dt + strongest_ * s.dt * s.dt / 2;
    return passed_ < kSettled || s.innovation <= std::max(sigmas_ * s.sigma, explained);
}

OutlierGate::Verdict OutlierGate::judge(const Surprise& surprise) noexcept {
    if (sigmas_ <= 0 || possible(surprise)) {
        refused_ = 0;
        passed_ = std::min(passed_ + 1, kSettled);
        return Verdict::pass;
    }
    return ++refused_ < kPersisting ? Verdict::refuse : Verdict::persists;
}

void OutlierGate::restart() noexcept {
    refused_ = 0;
    passed_ = 0;
}

}  // namespace tracking
