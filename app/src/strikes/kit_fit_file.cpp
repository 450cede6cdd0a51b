// The text of a fitted kit.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "strikes/kit_fit.h"

namespace app {
namespace {

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
    const double diameter = 2 * fitted.radius_m;
    const Eigen::Vector3d& met = fitted.met;
    return fmt::format(
        "\n# {}\n[[instrument]]\nname = \"{} {}\"\nkind = \"{}\"\nsize = [{:.3f}, {:.3f}, {:.3f}]\n"
        "position = [{:.4f}, {:.4f}, {:.4f}]\nmidi_note = {}\nsound = {{ frequency_hz = {:.1f} }}\n{}",
        describe(fitted), form.kind, index + 1, form.kind, diameter, form.height_m, diameter, met.x(),
        met.y() - tip_radius_m - form.height_m / 2, met.z(), form.notes[index % form.notes.size()], pitch_hz,
        form.extra);
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
    std::replace_if(
        name.begin(), name.end(),
        [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '"' || c == '\\'; },
        '_');
    return name;
}

}  // namespace

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
