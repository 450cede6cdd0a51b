#include "strikes/kit_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "files/bad_input.h"
#include "kit/tip_track.h"
#include "statistics/statistics.h"
#include "strikes/stroke_lows.h"

namespace app {
namespace {

constexpr double kKernelM = 0.20;       // of the mean shift
constexpr double kSeparateM = 0.20;     // nearer clusters are one
constexpr std::size_t kSeeds = 1000;    // of the mean shift
constexpr std::size_t kFewestLows = 3;  // of a cluster
constexpr std::size_t kMostInstruments = 16;
constexpr double kStruckShare =
    0.15;  // a tenth of a swinging saber's lows can lie near its lowest, a third of a mallet's do
constexpr double kStruckSpreadM = 0.030;   // inter-quartile range
constexpr double kStruckTurningS = 0.020;  // mallets 7-14 ms, sabers 20-120 ms
constexpr double kOverHandM = 0.10;
constexpr double kAboveContactM = 0.025;
constexpr double kEnterM = 0.003;
constexpr double kHeadShare = 0.9;  // of the radius: the rest is rim
constexpr double kMarginM = 0.02, kSmallestRadiusM = 0.10, kLargestRadiusM = 0.30, kGapBetweenM = 0.02;

using Lows = std::vector<Low>;

Eigen::Vector2d plan(const Eigen::Vector3d& p) {
    return {p.x(), p.z()};
}

struct Mode {
    Eigen::Vector2d place;
    std::size_t support;
};

/// Climbs from a place to the middle of the densest disc about it.
Mode climb(const Eigen::Vector2d& place, const Lows& lows) {
    constexpr int kMostSteps = 100;
    Mode mode{place, 0};
    for (int step = 0; step < kMostSteps; ++step) {
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        mode.support = 0;
        for (const Low& low : lows) {
            if ((plan(low.tip) - mode.place).norm() > kKernelM) continue;
            sum += plan(low.tip);
            ++mode.support;
        }
        const Eigen::Vector2d middle = sum / static_cast<double>(mode.support);
        const double moved = (middle - mode.place).norm();
        mode.place = middle;
        if (moved < 1e-6) break;
    }
    return mode;
}

/// The clusters' middles, the best supported first.
std::vector<Eigen::Vector2d> find_places(const Lows& lows) {
    std::vector<Mode> modes;
    const std::size_t stride = 1 + (lows.size() - 1) / kSeeds;
    for (std::size_t i = 0; i < lows.size(); i += stride) modes.push_back(climb(plan(lows[i].tip), lows));
    std::stable_sort(modes.begin(), modes.end(),
                     [](const Mode& a, const Mode& b) { return a.support > b.support; });
    std::vector<Eigen::Vector2d> places;
    for (const Mode& mode : modes)
        if (std::all_of(places.begin(), places.end(),
                        [&](const Eigen::Vector2d& p) { return (p - mode.place).norm() >= kSeparateM; }))
            places.push_back(mode.place);
    return places;
}

std::vector<Lows> assign(const Lows& lows, const std::vector<Eigen::Vector2d>& places) {
    std::vector<Lows> clusters(places.size());
    for (const Low& low : lows) {
        const auto farther = [&](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
            return (a - plan(low.tip)).norm() < (b - plan(low.tip)).norm();
        };
        const auto nearest = std::min_element(places.begin(), places.end(), farther);
        clusters[static_cast<std::size_t>(nearest - places.begin())].push_back(low);
    }
    return clusters;
}

std::vector<double> heights_of(const Lows& lows) {
    std::vector<double> heights;
    for (const Low& low : lows) heights.push_back(low.tip.y());
    std::sort(heights.begin(), heights.end());
    return heights;
}

/// The lows that a head stopped: within 50 mm of the lowest that is no stray, if they agree and turn sharply;
/// else none.
Lows stopped_lows(const Lows& lows) {
    const std::vector<double> heights = heights_of(lows);
    const auto needed =
        std::max(std::min(kFewestLows, lows.size()),
                 static_cast<std::size_t>(std::ceil(kStruckShare * static_cast<double>(lows.size()))));
    std::size_t lowest = 0;  // of a group large enough: a stray low beneath it does not hide a head
    while (lowest + needed < heights.size() && heights[lowest + needed - 1] > heights[lowest] + kNearLowestM)
        ++lowest;
    Lows near;
    std::vector<double> turning;
    for (const Low& low : lows)
        if (low.tip.y() >= heights[lowest] && low.tip.y() <= heights[lowest] + kNearLowestM) {
            near.push_back(low);
            turning.push_back(low.turning_s);
        }
    const std::vector<double> near_heights = heights_of(near);
    const double spread = quantile(near_heights, 0.75) - quantile(near_heights, 0.25);
    if (near.size() < needed || spread > kStruckSpreadM || quantile(turning, 0.5) > kStruckTurningS)
        return {};
    return near;
}

FittedInstrument place_instrument(const Lows& lows) {
    FittedInstrument instrument;
    const Lows stopped = stopped_lows(lows);
    instrument.struck = !stopped.empty();
    const Lows& strokes = instrument.struck ? stopped : lows;
    for (const Low& low : strokes) instrument.met += low.tip / static_cast<double>(strokes.size());
    if (instrument.struck) {
        instrument.contact_height_m = contact_height(stopped);
        instrument.met.y() = instrument.contact_height_m + kAboveContactM;
    } else {
        instrument.met.y() = quantile(heights_of(lows), 0.8);
    }
    std::vector<double> reach;
    for (const Low& low : strokes) reach.push_back((plan(low.tip) - plan(instrument.met)).norm());
    const double needed = (quantile(reach, instrument.struck ? 1.0 : 0.9) + kMarginM) / kHeadShare;
    instrument.radius_m = std::clamp(needed, kSmallestRadiusM, kLargestRadiusM);
    instrument.lows = static_cast<int>(lows.size());
    instrument.strokes = static_cast<int>(strokes.size());
    for (const Low& low : strokes) instrument.entering += low.tip.y() <= instrument.met.y() - kEnterM;
    return instrument;
}

/// Joins two clusters whose instruments would stand too near to each other; false when there are none.
bool join_nearest(std::vector<Lows>& clusters, const std::vector<FittedInstrument>& instruments) {
    for (std::size_t i = 0; i < instruments.size(); ++i)
        for (std::size_t k = i + 1; k < instruments.size(); ++k) {
            if ((plan(instruments[i].met) - plan(instruments[k].met)).norm() >= kSeparateM) continue;
            clusters[i].insert(clusters[i].end(), clusters[k].begin(), clusters[k].end());
            clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(k));
            return true;
        }
    return false;
}

std::vector<FittedInstrument> place_instruments(std::vector<Lows> clusters) {
    std::vector<FittedInstrument> instruments;
    do {
        instruments.clear();
        for (const Lows& lows : clusters) instruments.push_back(place_instrument(lows));
    } while (join_nearest(clusters, instruments));
    return instruments;
}

void make_room(std::vector<FittedInstrument>& instruments) {
    for (std::size_t i = 0; i < instruments.size(); ++i)
        for (std::size_t k = i + 1; k < instruments.size(); ++k) {
            FittedInstrument &a = instruments[i], &b = instruments[k];
            const double apart = (plan(a.met) - plan(b.met)).norm() - kGapBetweenM;
            const double share = std::min(1.0, apart / (a.radius_m + b.radius_m));
            a.radius_m *= share;
            b.radius_m *= share;
        }
}

/// The lows of all sticks, but for those with the tip over the hand: there a stick swings back overhead, it
/// does not strike.
Lows find_strokes(std::span<const tracking::Trace> traces, const StickGeometry& geometry) {
    StickGeometry hand_geometry = geometry;
    hand_geometry.tip.setZero();
    Lows strokes;
    for (const tracking::Trace& trace : traces) {
        const std::vector<TipTrack> tips = tip_tracks(trace, geometry),
                                    hands = tip_tracks(trace, hand_geometry);
        for (std::size_t stick = 0; stick < tips.size(); ++stick)
            for (const Low& low : find_lows(tips[stick])) {
                const std::vector<double>& times = hands[stick].t_s;
                const auto at = std::lower_bound(times.begin(), times.end(), low.t_s) - times.begin();
                if (low.tip.y() <= hands[stick].tip[static_cast<std::size_t>(at)].y() + kOverHandM)
                    strokes.push_back(low);
            }
    }
    return strokes;
}

Eigen::Vector3d mean_place(const tracking::StickTrace& stick) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const tracking::PoseSample& sample : stick.samples) sum += sample.position;
    return sum / static_cast<double>(stick.samples.size());
}

/// From the left stick to the right one, by their names; 0 if they have none.
Eigen::Vector3d left_to_right(std::span<const tracking::Trace> traces) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const tracking::Trace& trace : traces) {
        const auto named = [&](const char* name) {
            return std::find_if(trace.sticks.begin(), trace.sticks.end(),
                                [&](const auto& stick) { return stick.name == name; });
        };
        const auto left = named("left"), right = named("right");
        if (left != trace.sticks.end() && right != trace.sticks.end())
            sum += mean_place(*right) - mean_place(*left);
    }
    return sum;
}

/// From the tips to the hands, on the mean.
Eigen::Vector3d against_shafts(std::span<const tracking::Trace> traces, const Eigen::Vector3d& shaft) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double count = 1;
    for (const tracking::Trace& trace : traces)
        for (const tracking::StickTrace& stick : trace.sticks)
            for (const tracking::PoseSample& sample : stick.samples) {
                if (!sample.has_orientation) continue;
                sum -= sample.orientation * shaft;
                ++count;
            }
    return sum / count;
}

/// The player stands where the left stick is on the left; unnamed sticks have the hands on the player's side.
Eigen::Vector3d direction_to_player(std::span<const tracking::Trace> traces, const Eigen::Vector3d& shaft) {
    constexpr double kClearM = 0.05, kClearShaft = 0.1;
    const Eigen::Vector3d by_name = left_to_right(traces).cross(Eigen::Vector3d::UnitY());
    if (by_name.norm() > kClearM) return by_name.normalized();
    Eigen::Vector3d by_shaft = against_shafts(traces, shaft);
    by_shaft.y() = 0;
    return by_shaft.norm() > kClearShaft ? Eigen::Vector3d(by_shaft.normalized())
                                         : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

}  // namespace

KitFit fit_kit(std::span<const tracking::Trace> traces, const StickGeometry& geometry) {
    const Lows lows = find_strokes(traces, geometry);
    if (lows.empty())
        throw BadInput(
            fmt::format("{}: error: found no stroke (the tip never falls and rises by 25 mm), expected "
                        "strokes to fit a kit to",
                        traces.empty() ? "the trace" : traces.front().file));
    std::vector<Lows> clusters = assign(lows, find_places(lows));
    std::stable_sort(clusters.begin(), clusters.end(),
                     [](const Lows& a, const Lows& b) { return a.size() > b.size(); });
    const std::size_t fewest = std::min(kFewestLows, clusters.front().size());
    std::erase_if(clusters, [&](const Lows& cluster) { return cluster.size() < fewest; });
    if (clusters.size() > kMostInstruments) clusters.resize(kMostInstruments);

    KitFit fit;
    fit.towards_player = direction_to_player(traces, geometry.shaft);
    fit.instruments = place_instruments(std::move(clusters));
    make_room(fit.instruments);
    const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(fit.towards_player);
    std::stable_sort(fit.instruments.begin(), fit.instruments.end(),
                     [&](const auto& a, const auto& b) { return a.met.dot(right) < b.met.dot(right); });
    return fit;
}

std::string describe(const FittedInstrument& instrument) {
    const Eigen::Vector3d& met = instrument.met;
    const std::string strokes =
        fmt::format("{} of {} strokes go 3 mm deep or more", instrument.entering, instrument.strokes);
    if (instrument.struck)
        return fmt::format(
            "struck: {} of {} lows agree on a head at y = {:.3f} m; tips meet the instrument 25 mm above it; "
            "{}",
            instrument.strokes, instrument.lows, instrument.contact_height_m, strokes);
    return fmt::format(
        "passed through: {} lows with no head under them; tips meet the instrument at y = {:.3f} m, below "
        "which 80 % of them lie; {}",
        instrument.lows, met.y(), strokes);
}

}  // namespace app
