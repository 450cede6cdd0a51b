#pragma once
#include <sim/simulation.h>

#include <span>
#include <string>
#include <vector>

namespace app {

/// A predictor's specification with `auto` resolved: what measurements chose for pictures and for sound.
[[nodiscard]] std::string picture_specification(const std::string& specification);
[[nodiscard]] std::string sound_specification(const std::string& specification);

/// The filter that confirms the strikes of a sound predictor's specification; empty for none. With `auto`,
/// contacts less than 50 ms ahead must be confirmed by a second filter (keep_confirmed).
[[nodiscard]] std::string confirming_specification(const std::string& sound_specification);
/// Removes those of `contacts`, predicted at s, that are less than 50 ms ahead and not confirmed: a contact is
/// confirmed by one of `confirming`, the contacts of the second filter's path, with the same body at most 50 ms
/// later.
void keep_confirmed(std::vector<sim::Contact>& contacts, std::span<const sim::Contact> confirming, double s);

}  // namespace app
