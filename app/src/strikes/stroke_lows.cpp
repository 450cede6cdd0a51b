#include "strikes/stroke_lows.h"

#include <tracking/predictor.h>

#include <algorithm>
#include <limits>

#include "statistics/statistics.h"

namespace app {
namespace {

constexpr double kTurnWindowS = 0.009;  // two samples at 250 Hz, one at 90 Hz
constexpr double kSameLevelM = 0.002;   // noise that does not end a descent
constexpr double kProminenceM = 0.025;

double slope(const TipTrack& track, std::size_t from, std::size_t to) {
    return (track.tip[to].y() - track.tip[from].y()) / (track.t_s[to] - track.t_s[from]);
}

/// The low at sample `at`, of the piece [first, last] without gaps; first < at < last.
Low low_at(const TipTrack& track, std::size_t at, std::size_t first, std::size_t last) {
    Low low{track.t_s[at], track.tip[at], 0, track.t_s[at], track.tip[at], 0};
    for (std::size_t i = at; i > first && track.tip[i - 1].y() >= track.tip[i].y() - kSameLevelM; --i)
        if (const double fall = -slope(track, i - 1, i); fall > low.descent_mps) {
            low.descent_mps = fall;
            low.fastest_s = 0.5 * (track.t_s[i - 1] + track.t_s[i]);
            low.fastest = 0.5 * (track.tip[i - 1] + track.tip[i]);
        }
    std::size_t before = at - 1, after = at + 1;
    while (before > first && low.t_s - track.t_s[before] < kTurnWindowS) --before;
    while (after < last && track.t_s[after] - low.t_s < kTurnWindowS) ++after;
    const double acceleration =
        (slope(track, at, after) - slope(track, before, at)) / (0.5 * (track.t_s[after] - track.t_s[before]));
    low.turning_s =
        acceleration > 0 ? low.descent_mps / acceleration : std::numeric_limits<double>::infinity();
    return low;
}

/// The lows of the piece [first, last]: falls and rises of at least the prominence alternate.
void find_in_piece(const TipTrack& track, std::size_t first, std::size_t last, std::vector<Low>& lows) {
    std::size_t highest = first, lowest = first;
    bool falling = false;
    for (std::size_t i = first; i <= last; ++i) {
        const double y = track.tip[i].y();
        if (falling) {
            if (y < track.tip[lowest].y()) lowest = i;
            if (y - track.tip[lowest].y() < kProminenceM) continue;
            lows.push_back(low_at(track, lowest, first, last));
            falling = false;
            highest = i;
        } else {
            if (y > track.tip[highest].y()) highest = i;
            if (track.tip[highest].y() - y < kProminenceM) continue;
            falling = true;
            lowest = i;
        }
    }
}

}  // namespace

std::vector<Low> find_lows(const TipTrack& track) {
    std::vector<Low> lows;
    std::size_t first = 0;
    for (std::size_t i = 1; i <= track.t_s.size(); ++i) {
        if (i < track.t_s.size() && track.t_s[i] - track.t_s[i - 1] <= tracking::kGapS) continue;
        find_in_piece(track, first, i - 1, lows);
        first = i;
    }
    return lows;
}

double contact_height(std::span<const Low> lows) {
    std::vector<double> heights;
    for (const Low& low : lows) heights.push_back(low.tip.y());
    const double highest = std::ranges::min(heights) + kNearLowestM;
    std::erase_if(heights, [&](double height) { return height > highest; });
    return median(std::move(heights));
}

}  // namespace app
