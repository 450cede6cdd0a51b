#include "sticks/auto_predictor.h"

#include <algorithm>

namespace app {
namespace {

// What `auto` stands for, as measured on recorded mallets and sabers (README, figures). Pictures want the
// least mean error: a velocity that fades with the lead errs 5 to 25 % less than one that lasts, on every
// recording. Strikes want a path that bends: constant acceleration times them best, and the constant
// velocity, which does not overshoot after a rebound, confirms them.
constexpr const char* kAutoPicture = "cv:q=1e7,decay=8,r=0.5,gate=5";
constexpr const char* kAutoSound = "ca:q=7e8,gate=5";
constexpr const char* kAutoConfirming = "cv:q=1e8,gate=5";

constexpr double kNearS = 0.05;   // a contact nearer than this must be confirmed
constexpr double kLaterS = 0.05;  // constant velocity meets the surface later than a stroke that accelerates

}  // namespace

void keep_confirmed(std::vector<sim::Contact>& contacts, std::span<const sim::Contact> confirming, double s) {
    std::erase_if(contacts, [&](const sim::Contact& contact) {
        if (contact.t_s - s > kNearS) return false;
        return std::none_of(confirming.begin(), confirming.end(), [&](const sim::Contact& other) {
            return other.body == contact.body && other.t_s <= contact.t_s + kLaterS;
        });
    });
}

std::string confirming_specification(const std::string& specification) {
    return specification == "auto" ? kAutoConfirming : "";
}

std::string picture_specification(const std::string& specification) {
    return specification == "auto" ? kAutoPicture : specification;
}

std::string sound_specification(const std::string& specification) {
    return specification == "auto" ? kAutoSound : specification;
}

}  // namespace app
