#include "commands/kit_commands.h"

#include <fmt/format.h>
#include <render/renderer.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "files/assets.h"
#include "files/bad_input.h"
#include "files/finished_file.h"
#include "files/option_values.h"
#include "kit/kit.h"
#include "pictures/kit_stage.h"
#include "strikes/kit_fit.h"

namespace app {
namespace fs = std::filesystem;
namespace {

void list_kits() {
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::directory_iterator(assets_folder() / "kits"))
        if (entry.path().extension() == ".toml" && entry.path().stem() != "defaults")
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files)
        fmt::print("{:<10} {}\n", file.stem().string(), read_kit(file).description);
}

std::string zones_text(const Instrument& instrument) {
    std::string text;
    for (const ZoneSound& zone : instrument.zones)
        text += fmt::format("{}{} (MIDI {})", text.empty() ? "" : ", ", zone.name, zone.midi_note);
    return text;
}

void show_instrument(const Instrument& instrument) {
    const sim::BodyDefinition& body = instrument.body;
    const Eigen::Vector3d at = body.world_from_body.translation(), size = 2 * body.shape.semi_axes;
    fmt::print("\n{} ({})\n", instrument.name, instrument.kind);
    fmt::print("  position    {:.3f}, {:.3f}, {:.3f} m\n", at.x(), at.y(), at.z());
    fmt::print("  size        {:.4f} x {:.4f} x {:.4f} m, exponents {} and {}\n", size.x(), size.y(),
               size.z(), body.shape.e1, body.shape.e2);
    fmt::print("  held        {}\n", body.stand.hinged
                                         ? fmt::format("on a hinge, {} Hz, damping ratio {}",
                                                       body.stand.frequency_hz, body.stand.damping_ratio)
                                         : "fixed");
    fmt::print("  zones       {}\n", zones_text(instrument));
    fmt::print("  sound       {}", instrument.voice.instrument);
    for (const auto& [name, value] : instrument.voice.parameters) fmt::print(", {} = {}", name, value);
    fmt::print("\n");
}

void show_kit(const std::string& name) {
    const Kit kit = read_kit(find_kit(name));
    fmt::print("{}: {}\n", kit.name, kit.description.empty() ? "(no description)" : kit.description);
    for (const fs::path& file : kit.files) fmt::print("  read from   {}\n", file.string());
    fmt::print("  stick       {} m long, tip radius {} m, mass {} kg\n", kit.stick.length_m,
               kit.stick.radius_m, kit.stick.mass_kg);
    for (const Instrument& instrument : kit.instruments) show_instrument(instrument);
}

void draw_kit(const std::string& name, const std::string& out, const std::string& size) {
    const Eigen::Vector2i pixels = parse_size(size, "--size");
    if (pixels.minCoeff() < 16 || pixels.maxCoeff() > 8192)
        throw BadInput(fmt::format("error: found --size {}, expected 16x16 to 8192x8192", size));
    const Kit kit = read_kit(find_kit(name));
    const KitStage stage(kit, 0, StickGeometry{});
    render::Renderer renderer(stage.scene(pixels.x(), pixels.y()));
    render::Image image;
    renderer.draw(stage.frame({}, {}), image);
    write_finished_file(out, render::encode_png(image));
}

struct FitArguments {
    std::vector<std::string> traces;
    std::string kind = "drum", radius = "0.006", tip, shaft, out;
};

/// The sticks of all traces must be alike, as the kit has one [stick].
StickGeometry common_geometry(const std::vector<tracking::Trace>& traces, const FitArguments& a) {
    StickDefinition stick;
    stick.radius_m = parse_number(a.radius, "--radius");
    if (!(stick.radius_m >= 0.001 && stick.radius_m <= 0.1))
        throw BadInput(fmt::format("error: found --radius {}, expected 0.001 to 0.1 m", a.radius));
    std::optional<Eigen::Vector3d> tip, shaft;
    if (!a.tip.empty()) tip = parse_vector(a.tip, "--tip");
    if (tip && tip->cwiseAbs().maxCoeff() > 2)
        throw BadInput(fmt::format("error: found --tip {}, expected coordinates within 2 m", a.tip));
    if (!a.shaft.empty()) shaft = parse_axis(a.shaft, "--shaft");
    StickGeometry first = stick_geometry(traces.front(), stick, tip, shaft);
    for (const tracking::Trace& trace : traces) {
        const StickGeometry other = stick_geometry(trace, stick, tip, shaft);
        if (other.tip != first.tip || other.shaft != first.shaft)
            throw BadInput(
                fmt::format("{}: error: found a tip or shaft other than that of {}, expected one for all; "
                            "give --tip and --shaft",
                            trace.file, traces.front().file));
    }
    return first;
}

void fit(const FitArguments& a) {
    std::vector<tracking::Trace> traces;
    for (const std::string& file : a.traces) traces.push_back(tracking::read_trace(find_trace(file)));
    const StickGeometry geometry = common_geometry(traces, a);
    const KitFit fitted = fit_kit(traces, geometry);
    const std::string name = fs::path(a.traces.front()).filename().string();
    const std::string text = format_fitted_kit(fitted, a.kind, name, geometry, !a.tip.empty());
    if (a.out.empty()) {
        fmt::print("{}", text);
        return;
    }
    write_finished_file(a.out, text);
    for (std::size_t i = 0; i < fitted.instruments.size(); ++i)
        fmt::print("{} {}: {}\n", a.kind, i + 1, describe(fitted.instruments[i]));
}

/// A small kit to start from.
constexpr std::string_view kNewKit =
    R"(# A MusicWorld kit. Units: m, s, Hz; y is up, the player at the origin looks along -z.
# Every key is listed by `musicworld schema kit`; what is not said here comes from defaults.toml among the bundled kits.

name = "{}"
description = "a drum, a cymbal and a bell"

[camera]
eye = [0.0, 1.6, 0.5]
target = [0.0, 0.8, -0.5]

[[instrument]]
name = "drum"
kind = "drum"                      # drum, cymbal, bell or string
size = [0.36, 0.16, 0.36]          # full extents along the body's x, y, z; y is the axis of a drum
position = [-0.15, 0.68, -0.45]    # of its middle: the head is half a height above
tilt_deg = [6, 0, 0]               # about x, y, z: 6 degrees towards the player
midi_note = 38
sound = {{ frequency_hz = 190, decay_s = 0.5, snare = 0.5 }}   # parameters of the orchestra's instrument

[[instrument]]
name = "cymbal"
kind = "cymbal"
size = [0.44, 0.024, 0.44]
position = [0.35, 0.95, -0.60]
tilt_deg = [10, 0, 4]
midi_note = 51
sound = {{ frequency_hz = 300, decay_s = 3 }}

[[instrument]]
name = "bell"
kind = "bell"
size = [0.16, 0.18, 0.16]
position = [-0.5, 0.95, -0.6]
midi_note = 72
sound = {{ frequency_hz = 523.25 }}
)";

void make_new(const std::string& name, const std::string& out) {
    if (name.find_first_of("\"\\") != std::string::npos || std::any_of(name.begin(), name.end(), [](char c) {
            return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
        }))
        throw BadInput(
            "error: found a kit's name with quotes, backslashes or control characters, expected plain text");
    std::error_code error;
    if (fs::exists(out, error))
        throw BadInput(
            fmt::format("{}: error: found a file of that name, expected none; choose another --out", out));
    write_finished_file(out, fmt::format(kNewKit, name));
}

void add_fit(CLI::App& kit) {
    CLI::App* command = kit.add_subcommand("fit", "Place a kit where the sticks of traces strike");
    auto a = std::make_shared<FitArguments>();
    command->add_option("TRACE", a->traces, "Traces (CSV)")->required();
    command->add_option("--kind", a->kind, "Instruments to place")
        ->check(CLI::IsMember({"drum", "cymbal", "bell"}))
        ->capture_default_str();
    command->add_option("--radius", a->radius, "Radius of the tip [m]")->capture_default_str();
    command->add_option("--tip", a->tip, "Tip in the tracked body's frame, X,Y,Z [m]; the kit then says so");
    command->add_option("--shaft", a->shaft, "Body axis from hand to tip, e.g. -z (turns the camera)");
    command->add_option("--out", a->out, "Kit to write; printed if left out");
    command->callback([a] { fit(*a); });
}

void add_draw(CLI::App& kit) {
    CLI::App* command = kit.add_subcommand("draw", "Draw a kit at rest");
    auto name = std::make_shared<std::string>(), out = std::make_shared<std::string>();
    auto size = std::make_shared<std::string>("640x480");
    command->add_option("KIT", *name, "Kit: a file, or the name of a bundled one")->required();
    command->add_option("--out", *out, "Picture to write (PNG)")->required();
    command->add_option("--size", *size, "Its size")->capture_default_str();
    command->callback([name, out, size] { draw_kit(*name, *out, *size); });
}

void add_check(CLI::App& kit) {
    CLI::App* command = kit.add_subcommand("check", "Check kits; the first fault ends it");
    auto names = std::make_shared<std::vector<std::string>>();
    command->add_option("KIT", *names, "Kits: files, or names of bundled ones")->required();
    command->callback([names] {
        for (const std::string& name : *names) {
            const Kit checked = read_kit(find_kit(name));
            fmt::print("{}: in order, {} instruments\n", checked.file.string(), checked.instruments.size());
        }
    });
}

void add_new(CLI::App& kit) {
    CLI::App* command = kit.add_subcommand("new", "Write a small kit to start from");
    auto name = std::make_shared<std::string>(), out = std::make_shared<std::string>();
    command->add_option("NAME", *name, "The kit's name")->required();
    command->add_option("--out", *out, "Kit to write (TOML)")->required();
    command->callback([name, out] { make_new(*name, *out); });
}

}  // namespace

void add_kit_command(CLI::App& program) {
    CLI::App* kit = program.add_subcommand("kit", "List, show, check, draw, fit or make kits");
    kit->require_subcommand(1);
    kit->add_subcommand("list", "List the bundled kits")->callback(list_kits);
    CLI::App* show = kit->add_subcommand("show", "Show what a kit holds");
    auto name = std::make_shared<std::string>();
    show->add_option("KIT", *name, "Kit: a file, or the name of a bundled one")->required();
    show->callback([name] { show_kit(*name); });
    add_check(*kit);
    add_draw(*kit);
    add_fit(*kit);
    add_new(*kit);
}

}  // namespace app
