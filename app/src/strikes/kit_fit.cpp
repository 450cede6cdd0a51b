#include "strikes/kit_fit.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "files/bad_input.h"
#include "statistics/statistics.h"
#include "strikes/stroke_lows.h"

namespace app {
namespace {

constexpr double kKernelM = 0.20;       // of the mean shift; nearer clusters are one
constexpr std::size_t kSeeds = 1000;    // of the mean shift
constexpr std::size_t kFewestLows = 3;  // of a cluster
constexpr std::size_t kMostInstruments = 16;
constexpr double kStruckShare =
    0.15;  // a tenth of a swinging saber's lows can lie near its lowest, a third of a mallet's do
constexpr double kStruckSpreadM = 0.030;   // inter-quartile range
constexpr double kStruckTurningS = 0.020;  // mallets 7-14 ms, sabers 20-120 ms
constexpr double kOverHandM = 0.10, kBehindHandM = 0.05;
constexpr double kAboveContactM = 0.025;
constexpr double kEnterM = 0.003;
constexpr double kHeadShare = 0.9;  // of the radius: the rest is rim
constexpr double kMarginM = 0.02, kSmallestRadiusM = 0.10, kGapBetweenM = 0.02;
constexpr double kLargestRadius = 1.5;  // kernels

using Lows = std::vector<Low>;
/// What of a stroke is clustered: its lowest or its fastest point.
using Point = Eigen::Vector3d Low::*;

Eigen::Vector2d plan(const Eigen::Vector3d& p) {
    return {p.x(), p.z()};
}

struct Mode {
    Eigen::Vector2d place;
    std::size_t support;
};

/// Climbs from a place to the middle of the densest disc about it.
Mode climb(const Eigen::Vector2d& place, const Lows& lows, Point point, double kernel_m) {
    constexpr int kMostSteps = 100;
    Mode mode{place, 0};
    for (int step = 0; step < kMostSteps; ++step) {
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        mode.support = 0;
        for (const Low& low : lows) {
            if ((plan(low.*point) - mode.place).norm() > kernel_m) continue;
            sum += plan(low.*point);
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
std::vector<Eigen::Vector2d> find_places(const Lows& lows, Point point, double kernel_m) {
    std::vector<Mode> modes;
    const std::size_t stride = 1 + (lows.size() - 1) / kSeeds;
    for (std::size_t i = 0; i < lows.size(); i += stride)
        modes.push_back(climb(plan(lows[i].*point), lows, point, kernel_m));
    std::ranges::stable_sort(modes, std::greater(), &Mode::support);
    std::vector<Eigen::Vector2d> places;
    for (const Mode& mode : modes)
        if (std::ranges::all_of(
                places, [&](const Eigen::Vector2d& p) { return (p - mode.place).norm() >= kernel_m; }))
            places.push_back(mode.place);
    return places;
}

/// Clusters about the densest places, the largest first; none of fewer than three, unless there are no others.
std::vector<Lows> clusters_of(const Lows& lows, Point point, double kernel_m) {
    const std::vector<Eigen::Vector2d> places = find_places(lows, point, kernel_m);
    std::vector<Lows> clusters(places.size());
    for (const Low& low : lows) {
        const auto distance = [&](const Eigen::Vector2d& place) { return (place - plan(low.*point)).norm(); };
        const auto nearest = std::ranges::min_element(places, {}, distance);
        clusters[static_cast<std::size_t>(nearest - places.begin())].push_back(low);
    }
    std::ranges::stable_sort(clusters, std::greater(), [](const Lows& cluster) { return cluster.size(); });
    const std::size_t fewest = std::min(kFewestLows, clusters.front().size());
    std::erase_if(clusters, [&](const Lows& cluster) { return cluster.size() < fewest; });
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

/// Where strokes that nothing stops are at their fastest, and above nearly all places where they turn: a surface among
/// these would be missed, and met, by millimetres.
double height_of_passing(const Lows& lows) {
    constexpr double kOverTurnsM = 0.05;
    std::vector<double> fastest;
    for (const Low& low : lows) fastest.push_back(low.fastest.y());
    return std::max(quantile(fastest, 0.5), quantile(heights_of(lows), 0.95) + kOverTurnsM);
}

/// Where a stroke passes a height, straight through its fastest and its lowest point.
Eigen::Vector3d passing(const Low& low, double height_m) {
    constexpr double kFarthest = 2;  // of the way between the two
    const Eigen::Vector3d way = low.fastest - low.tip;
    const double share = way.y() > 0 ? std::min((height_m - low.tip.y()) / way.y(), kFarthest) : 0;
    return low.tip + share * way;
}

FittedInstrument place_instrument(const Lows& lows, double kernel_m) {
    FittedInstrument instrument;
    const Lows stopped = stopped_lows(lows);
    instrument.struck = !stopped.empty();
    const Lows& strokes = instrument.struck ? stopped : lows;
    if (instrument.struck) instrument.contact_height_m = contact_height(stopped);
    const double height_m =
        instrument.struck ? instrument.contact_height_m + kAboveContactM : height_of_passing(lows);
    const auto met = [&](const Low& low) { return instrument.struck ? low.tip : passing(low, height_m); };
    for (const Low& low : strokes) instrument.met += met(low) / static_cast<double>(strokes.size());
    instrument.met.y() = height_m;
    std::vector<double> reach;
    for (const Low& low : strokes) reach.push_back((plan(met(low)) - plan(instrument.met)).norm());
    const double needed = (quantile(reach, instrument.struck ? 1.0 : 0.9) + kMarginM) / kHeadShare;
    instrument.radius_m = std::clamp(needed, kSmallestRadiusM, kLargestRadius * kernel_m);
    instrument.lows = static_cast<int>(lows.size());
    instrument.strokes = static_cast<int>(strokes.size());
    for (const Low& low : strokes) instrument.entering += low.tip.y() <= instrument.met.y() - kEnterM;
    return instrument;
}

/// Joins two clusters whose instruments would stand too near to each other; false when there are none.
bool join_nearest(std::vector<Lows>& clusters, const std::vector<FittedInstrument>& instruments,
                  double kernel_m) {
    for (std::size_t i = 0; i < instruments.size(); ++i)
        for (std::size_t k = i + 1; k < instruments.size(); ++k) {
            if ((plan(instruments[i].met) - plan(instruments[k].met)).norm() >= kernel_m) continue;
            clusters[i].insert(clusters[i].end(), clusters[k].begin(), clusters[k].end());
            clusters.erase(clusters.begin() + static_cast<std::ptrdiff_t>(k));
            return true;
        }
    return false;
}

std::vector<FittedInstrument> place_instruments(std::vector<Lows> clusters, double kernel_m) {
    std::vector<FittedInstrument> instruments;
    do {
        instruments.clear();
        for (const Lows& lows : clusters) instruments.push_back(place_instrument(lows, kernel_m));
    } while (join_nearest(clusters, instruments, kernel_m));
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

Eigen::Vector3d mean_place(const tracking::StickTrace& stick) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const tracking::PoseSample& sample : stick.samples) sum += sample.position;
    return sum / static_cast<double>(stick.samples.size());
}

/// From the left stick to the right one, by their names; 0 if they have none.
Eigen::Vector3d left_to_right(std::span<const tracking::Trace> traces) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const tracking::Trace& trace : traces) {
        const auto left = std::ranges::find(trace.sticks, "left", &tracking::StickTrace::name),
                   right = std::ranges::find(trace.sticks, "right", &tracking::StickTrace::name);
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

/// How many of the strokes pass beside an instrument, so near that 6 ms before nobody can tell.
double share_beside(const Lows& strokes, const std::vector<FittedInstrument>& instruments) {
    constexpr double kUntoldS = 0.006;
    const auto is_beside = [&](const Low& low) {
        return std::ranges::any_of(instruments, [&](const FittedInstrument& instrument) {
            const Eigen::Vector3d passed = passing(low, instrument.met.y());
            const double off = (plan(passed) - plan(instrument.met)).norm() - instrument.radius_m;
            return off > 0 && off < kUntoldS * low.descent_mps;
        });
    };
    return static_cast<double>(std::ranges::count_if(strokes, is_beside)) /
           static_cast<double>(strokes.size());
}

/// Instruments that strokes pass through, of the strokes that nothing stops: of the hard ones, for between strokes a stick
/// sways, where they are fastest, and only where many of them pass. As many as strokes can be told apart by.
std::vector<FittedInstrument> place_passed(Lows strokes) {
    constexpr double kHardShare = 0.5, kManyShare = 0.1, kMostBeside = 0.1;
    if (strokes.empty()) return {};
    std::vector<double> descents;
    for (const Low& low : strokes) descents.push_back(low.descent_mps);
    const double hard_mps = kHardShare * quantile(std::move(descents), 0.9);
    std::erase_if(strokes, [&](const Low& low) { return low.descent_mps < hard_mps; });
    std::vector<FittedInstrument> instruments;
    for (const double kernel_m : {kKernelM, 0.3, 0.45, 0.7}) {
        std::vector<Lows> clusters = clusters_of(strokes, &Low::fastest, kernel_m);
        const auto many = static_cast<std::size_t>(kManyShare * static_cast<double>(clusters.front().size()));
        std::erase_if(clusters, [&](const Lows& cluster) { return cluster.size() < many; });
        instruments = place_instruments(std::move(clusters), kernel_m);
        make_room(instruments);
        if (share_beside(strokes, instruments) <= kMostBeside) break;
    }
    return instruments;
}

/// The lows of all sticks, but for those where a stick swings back: with the tip over the hand at the end, or behind it
/// where it falls fastest.
Lows find_strokes(std::span<const tracking::Trace> traces, const StickGeometry& geometry,
                  const Eigen::Vector3d& towards_player) {
    Lows strokes;
    for (const tracking::Trace& trace : traces)
        for (const tracking::StickTrace& stick : trace.sticks) {
            const auto hand_at = [&](double t_s) {
                return std::ranges::lower_bound(stick.samples, t_s, {}, &tracking::PoseSample::t_s)->position;
            };
            for (const Low& low : find_lows(tip_track(stick, geometry)))
                if (low.tip.y() <= hand_at(low.t_s).y() + kOverHandM &&
                    (low.fastest - hand_at(low.fastest_s)).dot(towards_player) <= kBehindHandM)
                    strokes.push_back(low);
        }
    return strokes;
}

/// What a kind of instrument looks and sounds like in a fitted kit.
struct Form {
    std::string kind;
    double height_m;
    std::string extra;  // further lines of an instrument
    double highest_hz, lowest_hz;
    std::array<int, 6> notes;  // General MIDI percussion; for bells a C major scale
};

Form form_of(const std::string& kind) {
    if (kind == "cymbal") return {kind, 0.024, "", 450, 250, {49, 57, 51, 59, 55, 52}};
    if (kind == "bell")
        return {kind,   0.03,   "exponents = [0.2, 0.2]\nmesh = \"bar.obj\"\nstand = { drawn = false }\n",
                1046.5, 523.25, {72, 74, 76, 77, 79, 81}};
    return {kind, 0.15, "", 220, 80, {50, 48, 47, 45, 43, 41}};
}

std::string instrument_text(const FittedInstrument& fitted, const Form& form, std::size_t index,
                            std::size_t count, double tip_radius_m) {
    const double share = count > 1 ? static_cast<double>(index) / static_cast<double>(count - 1) : 0.5;
    const double pitch_hz = form.highest_hz * std::pow(form.lowest_hz / form.highest_hz, share);
    constexpr double kDiscM = 0.03;  // a side hardly to be met: strokes that pass come from everywhere
    const double diameter = 2 * fitted.radius_m,
                 height_m = fitted.struck ? form.height_m : std::min(form.height_m, kDiscM);
    // What strokes of 30 m/s would visibly bend by more than its thickness would meet them again.
    const char* const stiff = fitted.struck ? "" : "visual = { displacement = 0.001 }\n";
    const Eigen::Vector3d& met = fitted.met;
    return fmt::format(
        "\n# {}\n[[instrument]]\nname = \"{} {}\"\nkind = \"{}\"\nsize = [{:.3f}, {:.3f}, {:.3f}]\n"
        "position = [{:.4f}, {:.4f}, {:.4f}]\nmidi_note = {}\nsound = {{ frequency_hz = {:.1f} }}\n{}{}",
        describe(fitted), form.kind, index + 1, form.kind, diameter, height_m, diameter, met.x(),
        met.y() - tip_radius_m - height_m / 2, met.z(), form.notes[index % form.notes.size()], pitch_hz,
        form.extra, stiff);
}

/// Looks from behind the hands and from above at a ball that holds every instrument.
std::string camera_text(const KitFit& fit) {
    constexpr double kFieldDeg = 45, kElevation = 0.6, kAroundM = 0.12;
    Eigen::AlignedBox3d box;
    for (const FittedInstrument& i : fit.instruments) {
        const Eigen::Vector3d reach(i.radius_m, kAroundM, i.radius_m);
        box.extend(Eigen::AlignedBox3d(i.met - reach, i.met + reach));
    }
    const Eigen::Vector3d target = box.center();
    const double distance =
        std::max(0.7, 0.5 * box.diagonal().norm() / std::sin(kFieldDeg / 2 * std::numbers::pi / 180));
    const Eigen::Vector3d eye = target + distance * (std::cos(kElevation) * fit.towards_player +
                                                     std::sin(kElevation) * Eigen::Vector3d::UnitY());
    return fmt::format(
        "\n[camera]\neye = [{:.3f}, {:.3f}, {:.3f}]\ntarget = [{:.3f}, {:.3f}, {:.3f}]\nvertical_fov_deg = "
        "{}\n",
        eye.x(), eye.y(), eye.z(), target.x(), target.y(), target.z(), kFieldDeg);
}

std::string room_text(const KitFit& fit) {
    constexpr double kLegsM = 0.4;
    double lowest = fit.instruments.front().met.y();
    for (const FittedInstrument& i : fit.instruments) lowest = std::min(lowest, i.met.y());
    return lowest - kLegsM > 0 ? "" : fmt::format("\n[room]\nfloor_height = {:.3f}\n", lowest - 2 * kLegsM);
}

/// A name as it may stand in a comment and in quotes.
std::string plain(std::string name) {
    for (char& c : name)
        if (is_control(c) || c == '"' || c == '\\') c = '_';
    return name;
}

}  // namespace

KitFit fit_kit(std::span<const tracking::Trace> traces, const StickGeometry& geometry) {
    KitFit fit;
    fit.towards_player = direction_to_player(traces, geometry.shaft);
    const Lows lows = find_strokes(traces, geometry, fit.towards_player);
    if (lows.empty())
        throw BadInput(
            fmt::format("{}: error: found no stroke (the tip never falls and rises by 25 mm), expected "
                        "strokes to fit a kit to",
                        traces.empty() ? "the trace" : traces.front().file));
    std::vector<Lows> struck = clusters_of(lows, &Low::tip, kKernelM);
    Lows passing;
    std::erase_if(struck, [&](const Lows& cluster) {
        const bool none = stopped_lows(cluster).empty();
        if (none) passing.insert(passing.end(), cluster.begin(), cluster.end());
        return none;
    });
    fit.instruments = place_instruments(std::move(struck), kKernelM);
    for (const FittedInstrument& other : place_passed(std::move(passing))) {
        const auto near = [&](const FittedInstrument& one) {
            return (plan(one.met) - plan(other.met)).norm() < kKernelM;
        };
        if (std::ranges::none_of(fit.instruments, near)) fit.instruments.push_back(other);
    }
    if (fit.instruments.size() > kMostInstruments) fit.instruments.resize(kMostInstruments);
    make_room(fit.instruments);
    const Eigen::Vector3d right = Eigen::Vector3d::UnitY().cross(fit.towards_player);
    std::ranges::stable_sort(fit.instruments, {},
                             [&](const FittedInstrument& i) { return i.met.dot(right); });
    return fit;
}

std::string describe(const FittedInstrument& instrument) {
    const std::string strokes =
        fmt::format("{} of {} strokes go 3 mm deep or more", instrument.entering, instrument.strokes);
    if (instrument.struck)
        return fmt::format(
            "struck: {} of {} lows agree on a head at y = {:.3f} m; tips meet the instrument 25 mm above it; "
            "{}",
            instrument.strokes, instrument.lows, instrument.contact_height_m, strokes);
    return fmt::format(
        "passed through: {} lows with no head under them; tips meet the instrument at y = {:.3f} m, where "
        "they "
        "are fast; {}",
        instrument.lows, instrument.met.y(), strokes);
}

std::string format_fitted_kit(const KitFit& fit, const std::string& kind, const std::string& name,
                              const StickGeometry& geometry, bool write_tip) {
    const Form form = form_of(kind);
    std::string text = fmt::format(
        "# A kit placed where the sticks of {} strike.\n\nname = \"Fitted to {}\"\n\n[stick]\nradius = {}\n",
        plain(name), plain(name), geometry.radius_m);
    if (write_tip)
        text += fmt::format("tip = [{}, {}, {}]\n", geometry.tip.x(), geometry.tip.y(), geometry.tip.z());
    text += camera_text(fit) + room_text(fit);
    for (std::size_t i = 0; i < fit.instruments.size(); ++i)
        text += instrument_text(fit.instruments[i], form, i, fit.instruments.size(), geometry.radius_m);
    return text;
}

}  // namespace app
