#pragma once
#include <sim/simulation.h>

#include <span>
#include <string>
#include <vector>

namespace app {

/// A predictor's specification with `auto` resolved: what measurements chose for pictures and for sound.
[[nodiscard]] std::string picture_specification(const std::string& specification);
[[nodiscard]] std::string sound_specification(const std::string& specification);

/// What confirms the strikes of a sound predictor's specification: empty for none. `auto` finds contacts with
/// one filter and believes them, when they are near, only if another bears them out (keep_confirmed).
[[nodiscard]] std::string confirming_specification(const std::string& sound_specification);
/// Keeps of `contacts`, predicted at s, those that are not yet near (50 ms) and those that the confirming
/// predictor bears out: its path meets the same body too, at most 50 ms later.
void keep_confirmed(std::vector<sim::Contact>& contacts, std::span<const sim::Contact> borne_out, double s);

}  // namespace app
