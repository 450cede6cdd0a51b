#include <audio/samples.h>
#include <fmt/format.h>
#include <render/mesh.h>
#include <render/renderer.h>
#include <tracking/input.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <set>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/assets.h"
#include "files/bad_input.h"
#include "files/output_file.h"
#include "files/output_folder.h"
#include "kit/kit.h"
#include "kit/kit_copy.h"
#include "kit/mesh_contact.h"
#include "pictures/kit_stage.h"
#include "play/audition.h"
#include "report/plot.h"
#include "sticks/trace_warnings.h"
#include "strikes/kit_fit.h"

namespace app {
namespace fs = std::filesystem;
namespace {

void list_kits() {
    for (const std::string& name : bundled_names("kits"))
        fmt::print("{:<10} {}\n", name, read_kit(find_kit(name)).description);
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
    if (const auto& samples = instrument.voice.samples) {
        fmt::print("  sound       {}, {}\n", samples->files.front().string(),
                   counted(samples->regions.size(), "region"));
        return;
    }
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

std::vector<fs::path> meshes_of(const Kit& kit) {
    std::set<fs::path> meshes = {kit.stick.mesh};
    for (const Instrument& instrument : kit.instruments) meshes.insert(instrument.mesh);
    return {meshes.begin(), meshes.end()};
}

/// "superquadric of 0.3 x 0.1 x 0.3 m, exponents 0.9 and 1, ..." and how far the mesh lies from it.
std::string contact_text(const sim::Superquadric& shape, const sim::SurfaceError& error) {
    const Eigen::Vector3d size = 2 * shape.semi_axes;
    const double whole = size.maxCoeff();
    return fmt::format(
        "{:.3g} x {:.3g} x {:.3g} m with exponents {:.2f} and {:.2f}, from which the mesh lies "
        "{:.1f} mm apart (RMS, {:.1f} % of its size), at most {:.1f} mm ({:.1f} %)",
        size.x(), size.y(), size.z(), shape.e1, shape.e2, 1e3 * error.rms_m, 100 * error.rms_m / whole,
        1e3 * error.greatest_m, 100 * error.greatest_m / whole);
}

/// A line for each own mesh: what is struck, and how far that lies from what is seen.
void tell_contact(const Kit& kit) {
    constexpr double kFar = 0.05;  // of the body's size
    for (const Instrument& instrument : kit.instruments) {
        if (instrument.mesh.parent_path() == assets_folder() / "meshes") continue;
        const sim::Superquadric& shape = instrument.body.shape;
        const OuterSurface outer =
            outer_surface(render::load_mesh(instrument.mesh), instrument.body_from_mesh);
        const sim::SurfaceError error =
            instrument.fitted.value_or(sim::surface_error(shape, Eigen::Vector3d::Zero(), outer.points));
        const bool is_far = error.greatest_m > 2 * kFar * shape.semi_axes.maxCoeff();
        if (outer.inside_out)
            fmt::print(
                "{}: \"{}\": the faces of {} look inwards, so it is drawn inside out; turn its normals where "
                "it was made (what is struck is right)\n",
                kit.file.string(), instrument.name, instrument.mesh.filename().string());
        fmt::print("{}: \"{}\" is struck as a superquadric of {}{}{}\n", kit.file.string(), instrument.name,
                   contact_text(shape, error),
                   outer.hollow_m > 0
                       ? fmt::format("; hollows of up to {:.0f} mm are closed", 1e3 * outer.hollow_m)
                       : "",
                   !is_far ? ""
                   : instrument.fitted
                       ? "; where a mesh is bent or has parts that stick out it is struck beside what is "
                         "seen: leave such parts out, or make several instruments of it"
                       : "; shape = \"mesh\" fits it to the mesh");
    }
}

/// A line for each mesh whose size is not its instrument's, with the scale that would make it so.
void tell_sizes(const Kit& kit) {
    for (const Instrument& instrument : kit.instruments) {
        const Eigen::AlignedBox3f bounds = render::load_mesh(instrument.mesh).bounds();
        const double extent = bounds.sizes().cast<double>().maxCoeff(), size = instrument.given_size_m,
                     drawn = (instrument.body_from_mesh.linear() * bounds.sizes().cast<double>()).maxCoeff();
        if (!(extent > 0) || (drawn < 2 * size && drawn > size / 2)) continue;
        constexpr std::pair<double, const char*> kUnits[] = {
            {1, "metres"}, {0.001, "millimetres"}, {0.01, "centimetres"}, {0.0254, "inches"}};
        std::string offer = fmt::format("mesh_scale = {:.3g} makes it as large", size / extent);
        for (const auto& [unit, name] : kUnits)
            if (extent * unit < 1.5 * size && extent * unit > size / 1.5)
                offer = fmt::format("mesh_scale = {} if it is in {}", unit, name);
        fmt::print("{}: \"{}\" is {:.3g} m large, its mesh {} is drawn {:.3g} m large: {}\n",
                   kit.file.string(), instrument.name, size, instrument.mesh.filename().string(), drawn,
                   offer);
    }
}

struct DrawOptions {
    std::string kit, out;
    Eigen::Vector2i size = {640, 480};  // [pixels]
    CameraChoice camera;
};

void draw_kit(const DrawOptions& o) {
    if (fs::path(o.out).extension() != ".png")
        refuse_options("--out " + o.out, "a file whose name ends in .png");
    const Kit kit = read_kit(find_kit(o.kit));
    tell_sizes(kit);
    const KitStage stage(kit, 0, StickGeometry{}, o.camera);
    render::Renderer renderer(stage.scene(o.size.x(), o.size.y()));
    render::Image image;
    renderer.draw(stage.frame({}, {}), image);
    write_finished_file(o.out, render::encode_png(image));
}

/// A kit is somebody's work: one that is there is replaced only if that is asked for.
void require_new(const fs::path& out, bool force) {
    if (!force && output_place(out).kind == OutputPlace::Kind::file)
        refuse_options(fmt::format("--out {}, which is there already", out.string()),
                       "a new name, or --force to replace it");
}

struct FitOptions {
    std::vector<std::string> traces;
    std::string kind = "drum", out;
    double radius_m = 0.006;
    std::optional<Eigen::Vector3d> tip, shaft;
    bool force = false;
};

/// The sticks of all traces must be alike, as the kit has one [stick].
StickGeometry common_geometry(const std::vector<tracking::Trace>& traces, const FitOptions& o) {
    StickDefinition stick;
    stick.radius_m = o.radius_m;
    const StickGeometry first = stick_geometry(traces.front(), stick, o.tip, o.shaft);
    for (const tracking::Trace& trace : traces) {
        const StickGeometry other = stick_geometry(trace, stick, o.tip, o.shaft);
        if (other.tip != first.tip || other.shaft != first.shaft)
            throw BadInput(
                fmt::format("{}: error: found a tip or shaft other than that of {}, expected one for all; "
                            "give --tip and --shaft",
                            trace.file, traces.front().file));
    }
    return first;
}

void fit(const FitOptions& o) {
    if (!o.out.empty()) require_new(o.out, o.force);
    std::vector<tracking::Trace> traces;
    for (const std::string& file : o.traces) traces.push_back(tracking::read_trace(find_trace(file)));
    const StickGeometry geometry = common_geometry(traces, o);
    const KitFit fitted = fit_kit(traces, geometry);
    const std::string name = fs::path(o.traces.front()).filename().string();
    const std::string text = format_fitted_kit(fitted, o.kind, name, geometry, o.tip.has_value());
    if (o.out.empty()) {
        fmt::print("{}", text);
    } else {
        write_finished_file(o.out, text);
        for (std::size_t i = 0; i < fitted.instruments.size(); ++i)
            fmt::print("{} {}: {}\n", o.kind, i + 1, describe(fitted.instruments[i]));
    }
    for (const tracking::Trace& trace : traces) warn_of_units(trace);
}

void make_new(const std::string& name, const std::string& out, bool force) {
    require_new(out, force);
    if (name.find_first_of("\"\\") != std::string::npos || std::ranges::any_of(name, is_control))
        refuse_options("a kit's name with quotes, backslashes or control characters", "plain text");
    constexpr std::string_view kName = "NAME";
    std::string kit = tracking::read_bytes((assets_folder() / "templates" / "kit.toml").string(), "a kit");
    write_finished_file(out, kit.replace(kit.find(kName), kName.size(), name));
}

void add_fit(Command& kit) {
    Command command = kit.command("fit", "Place a kit where the sticks of traces strike");
    auto o = std::make_shared<FitOptions>();
    command.options("TRACE", o->traces, as::text("TRACE"), "Traces (CSV)")->required();
    command.option("--kind", o->kind, as::choice({"drum", "cymbal", "bell"}), "Instruments to place");
    command.option("--radius", o->radius_m, as::number(0.001, 0.1, "m"), "Radius of the tip");
    command.option("--tip", o->tip, as::vector_of_3(as::number(-2, 2, "m")),
                   "Tip in the tracked body's frame; the kit then says so");
    command.option("--shaft", o->shaft, as::axis(), "Body axis from hand to tip (turns the camera)");
    command.option("--out", o->out, as::text("FILE"), "Kit to write; printed if left out");
    command.flag("--force", o->force, "Replace a kit that is there");
    command.runs([o] { fit(*o); });
}

void add_draw(Command& kit) {
    Command command = kit.command("draw", "Draw a kit at rest");
    auto o = std::make_shared<DrawOptions>();
    command.required("KIT", o->kit, as::text("KIT"), "Kit: a file, or the name of a bundled one");
    command.required("--out", o->out, as::text("FILE"), "Picture to write (PNG)");
    command.option("--size", o->size, as::pixels(16, 8192), "Its size");
    command.option(
        "--camera", o->camera, camera_format(),
        "Where it is seen from; default: the kit's camera, else all of it from the drummer's side");
    command.runs([o] { draw_kit(*o); });
}

/// Names what of sample files is not followed.
void tell_ignored(const Kit& kit) {
    std::set<std::string> told;
    for (const Instrument& instrument : kit.instruments) {
        const auto& samples = instrument.voice.samples;
        if (!samples || samples->ignored.empty()) continue;
        const std::string line = fmt::format("{}: not followed: {}\n", samples->files.front().string(),
                                             fmt::join(samples->ignored, ", "));
        if (told.insert(line).second) fmt::print("{}", line);
    }
}

void add_kit_check(Command& kit) {
    Command command = kit.command("check", "Check kits and their meshes; the first fault ends it");
    auto names = std::make_shared<std::vector<std::string>>();
    command.options("KIT", *names, as::text("KIT"), "Kits: files, or names of bundled ones")->required();
    command.runs([names] {
        for (const std::string& name : *names) {
            const Kit checked = read_kit(find_kit(name));
            (void)render::load_meshes(meshes_of(checked));
            check_own_orchestras(checked);
            tell_ignored(checked);
            tell_sizes(checked);
            tell_contact(checked);
            fmt::print("{}: in order, {}\n", checked.file.string(),
                       counted(checked.instruments.size(), "instrument"));
        }
    });
}

struct AuditionOptions {
    std::string kit, instrument, out = "audition";
    std::vector<double> speeds_mps = {1, 3, 8};
};

void hear(const AuditionOptions& o) {
    const Kit kit = read_kit(find_kit(o.kit));
    require_gnuplot();
    OutputFolder out(o.out, kAuditionProducts);
    const Audition heard = audition(kit, o.instrument, o.speeds_mps);
    (void)audio::write_wav(out.path("audition.wav"), heard.sound);
    out.adorn("audition.png", [&] {
        Plotter plotter(out.scratch());
        const fs::path file = out.path("audition.png");
        plotter.draw_files({{file, audition_sheet(kit, heard, file.string())}});
        if (!plotter.failure().empty()) throw std::runtime_error(plotter.failure());
    });
    out.finish();
    for (const AuditionRow& row : heard.rows) {
        const Instrument& instrument = kit.instruments[row.instrument];
        fmt::print("{:6.1f} s  {}, {}:", row.onset_s, instrument.name,
                   instrument.zones[static_cast<std::size_t>(row.zone)].name);
        for (std::size_t i = 0; i < o.speeds_mps.size(); ++i)
            fmt::print("  {:g} m/s peak {:.1f} dBFS", o.speeds_mps[i], level_of(heard, row, i).peak_db);
        fmt::print("\n");
    }
    fmt::print("Listen to {}, look at {}\n", (fs::path(o.out) / "audition.wav").string(),
               (fs::path(o.out) / "audition.png").string());
    throw_if_any(out.failures(), o.out);
}

void add_audition(Command& kit) {
    Command command = kit.command("audition", "Hear a kit: every zone struck at several speeds");
    auto o = std::make_shared<AuditionOptions>();
    command.required("KIT", o->kit, as::text("KIT"), "Kit: a file, or the name of a bundled one");
    command.option("--instrument", o->instrument, as::text("NAME"), "Only this one");
    command.option("--speeds", o->speeds_mps, as::list_of(as::number(0.2, 20, "m/s")),
                   "Speeds of the strokes");
    command.option("--out", o->out, as::text("DIR"), "Folder for audition.wav and audition.png");
    command.runs([o] { hear(*o); });
}

void add_copy(Command& kit) {
    Command command = kit.command("copy", "Copy a kit with all that it needs, to change it or to pass it on");
    auto name = std::make_shared<std::string>(), out = std::make_shared<std::string>();
    command.required("KIT", *name, as::text("KIT"), "Kit: a file, or the name of a bundled one");
    auto force = std::make_shared<bool>(false);
    command.required("--out", *out, as::text("FILE"),
                     "Kit to write (TOML); what it needs comes to FILE-files beside it");
    command.flag("--force", *force, "Replace a kit that is there");
    command.runs([name, out, force] {
        const std::filesystem::path original = find_kit(*name);
        require_new(*out, *force);
        (void)render::load_meshes(meshes_of(read_kit(original)));  // what is no mesh is not passed on
        copy_kit(original, *out);
    });
}

void add_new(Command& kit) {
    Command command = kit.command("new", "Write a small kit to start from");
    auto name = std::make_shared<std::string>(), out = std::make_shared<std::string>();
    command.required("NAME", *name, as::text("NAME"), "The kit's name");
    auto force = std::make_shared<bool>(false);
    command.required("--out", *out, as::text("FILE"), "Kit to write (TOML)");
    command.flag("--force", *force, "Replace a kit that is there");
    command.runs([name, out, force] { make_new(*name, *out, *force); });
}

}  // namespace

void add_kit_command(Command& program) {
    Command kit = program.command("kit", "List, show, check, draw, hear, copy, fit or make kits");
    kit.command("list", "List the bundled kits").runs(list_kits);
    Command show = kit.command("show", "Show what a kit holds");
    auto name = std::make_shared<std::string>();
    show.required("KIT", *name, as::text("KIT"), "Kit: a file, or the name of a bundled one");
    show.runs([name] { show_kit(*name); });
    add_kit_check(kit);
    add_draw(kit);
    add_fit(kit);
    add_new(kit);
    add_copy(kit);
    add_audition(kit);
}

}  // namespace app
