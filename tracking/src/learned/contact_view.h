#pragma once
#include "learned/stick_history.h"
#include "tracking/contact_times.h"

namespace tracking {

inline constexpr auto kPlaneNormal = static_cast<Eigen::Index>(StickHistory::kInputs);
inline constexpr std::size_t kContactInputs = StickHistory::kInputs + 3 + 2 + StickHistory::kSpans,
                             kContactOutputs = ContactTimes::kBins + 1;
using ContactInputs = Eigen::Matrix<float, static_cast<int>(kContactInputs), 1>;
using ContactOutputs = Eigen::Matrix<float, static_cast<int>(kContactOutputs), 1>;

/// All inputs of the network of contacts (contact_times()).
void look_at(const TipView& view, const Plane& plane, ContactInputs& inputs) noexcept;
/// Whether a plane is near enough for the network: the training has such planes alone.
[[nodiscard]] bool in_reach(const TipView& view, const Plane& plane) noexcept;

}  // namespace tracking
