#include <fmt/format.h>
#include <sim/modes.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "commands/command.h"
#include "commands/commands.h"
#include "files/output_folder.h"
#include "pictures/mode_pictures.h"
#include "report/json_document.h"

namespace app {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kMostElements = 10, kMostModes = 150, kElementModes = 75, kMostPictures = 75;
constexpr double kSmallest = 1e-6;  // a size [m]

struct ModesOptions {
    sim::ModesRequest request;
    Eigen::Vector3d size = Eigen::Vector3d::Zero();  // full extents [m]
    std::string shape = "box", out;
    std::optional<Eigen::Vector2d> exponents;
    bool json = false, frames = false;
};

/// The exponents of the shapes that have a name; a superquadric's are given.
Eigen::Vector2d exponents_of(const ModesOptions& o) {
    const bool free = o.shape == "superquadric";
    if (free && !o.exponents)
        refuse_options("--shape superquadric alone", "--exponents E1,E2 with it, such as 0.5,1");
    if (!free && o.exponents)
        refuse_options("--exponents with --shape " + o.shape,
                       "them with --shape superquadric only; leave one out");
    if (free) return *o.exponents;
    return o.shape == "box"         ? Eigen::Vector2d(0.1, 0.1)
           : o.shape == "ellipsoid" ? Eigen::Vector2d(1, 1)
                                    : Eigen::Vector2d(0.1, 1);  // a cylinder
}

sim::ModesRequest request_of(const ModesOptions& o) {
    sim::ModesRequest request = o.request;
    const Eigen::Vector2d exponents = exponents_of(o);
    request.shape.semi_axes = o.size / 2;
    request.shape.e1 = exponents[0], request.shape.e2 = exponents[1];
    request.domain = o.shape == "box" ? sim::ModeDomain::box : sim::ModeDomain::superquadric;
    return request;
}

/// The free vibration modes of one body, with what the mesh errs.
struct ModeReport {
    sim::ModesRequest request;
    std::string shape;  ///< as asked for: "box", "cylinder" ...
    sim::FreeVibrationModes modes;
    Eigen::VectorXd errors;  ///< of the frequencies, relative; NaN: not known
};
double frequency_hz(double eigenvalue) {
    return std::sqrt(std::max(0.0, eigenvalue)) / (2 * M_PI);
}

std::string heading(const ModeReport& report) {
    const sim::ModesRequest& r = report.request;
    const Eigen::Vector3d size = 2 * r.shape.semi_axes;
    std::string text = fmt::format("{} {:g} x {:g} x {:g} m", report.shape, size.x(), size.y(), size.z());
    if (r.domain == sim::ModeDomain::superquadric)
        text += fmt::format(" (exponents {:g}, {:g})", r.shape.e1, r.shape.e2);
    return text +
           fmt::format(", E {:g} Pa, nu {:g}, density {:g} kg/m3, {} x {} x {} elements of 27 nodes\n\n",
                       r.material.young_pa, r.material.poisson, r.material.density_kg_m3, r.elements,
                       r.elements, r.elements);
}

/// "stretching", "bending x", "shear xy", "twisting"; of rigid modes "translation x", "rotation z".
std::string mode_kind(int parity, bool rigid) {
    static constexpr std::array<std::string_view, 8> kElastic = {
        "stretching", "bending x", "bending y", "shear xy", "bending z", "shear xz", "shear yz", "twisting"};
    static constexpr std::array<std::string_view, 8> kRigid = {
        "", "translation x", "translation y", "rotation z", "translation z", "rotation y", "rotation x", ""};
    return std::string((rigid ? kRigid : kElastic).at(static_cast<std::size_t>(parity)));
}

std::string ending(const ModeReport& report) {
    const sim::GroupCut& cut = report.modes.cut;
    std::string text = fmt::format(
        "\nSix rigid modes are left out. error: how far the frequency is above that of an infinitely fine "
        "mesh, "
        "estimated with {} elements a side.\n",
        sim::finer_elements(report.request.elements));
    if (cut.below != cut.count)
        text += fmt::format(
            "{} modes cut a group of equal frequencies, of which any mixture is a mode: whole groups end at "
            "{} and "
            "{}.\n",
            cut.count, cut.below, cut.above);
    return text;
}

/// What is not known is null.
Json numbers(const Eigen::VectorXd& values) {
    return std::vector<double>(values.begin(), values.end());
}

/// A table for people.
std::string format_mode_table(const ModeReport& report) {
    std::string text =
        heading(report) + "mode  frequency [Hz]  eigenvalue [rad2/s2]  kind              error\n";
    for (int i = 0; i < report.modes.basis.count(); ++i) {
        const double eigenvalue = report.modes.eigenvalues[6 + i], error = report.errors[i];
        text += fmt::format("{:>4}  {:>14.6g}  {:>20.10g}  {:<11}  {:>10}\n", i + 1, frequency_hz(eigenvalue),
                            eigenvalue, mode_kind(report.modes.parity[6 + std::size_t(i)], false),
                            std::isfinite(error) ? fmt::format("{:.2g} %", 100 * error) : "unknown");
    }
    return text + ending(report);
}

/// The document of `modes --json`: lists over all modes, the six rigid ones first; an unknown error is null.
std::string format_mode_json(const ModeReport& report) {
    const sim::ModesRequest& r = report.request;
    const int n = 6 + report.modes.basis.count();
    const Eigen::VectorXd eigenvalues = report.modes.eigenvalues.head(n);
    Eigen::VectorXd errors = Eigen::VectorXd::Zero(n);
    errors.tail(n - 6) = report.errors;
    Json kinds = Json::array();
    for (int i = 0; i < n; ++i) kinds.push_back(mode_kind(report.modes.parity[std::size_t(i)], i < 6));
    const sim::GroupCut& cut = report.modes.cut;
    Json json = {{"size_m", numbers(2 * r.shape.semi_axes)},
                 {"shape", report.shape},
                 {"exponents", r.domain == sim::ModeDomain::box ? Json() : Json{r.shape.e1, r.shape.e2}},
                 {"young_pa", r.material.young_pa},
                 {"poisson", r.material.poisson},
                 {"density_kg_m3", r.material.density_kg_m3},
                 {"elements_per_side", r.elements},
                 {"eigenvalues_rad2_s2", numbers(eigenvalues)},
                 {"frequencies_hz", numbers(eigenvalues.unaryExpr(&frequency_hz))},
                 {"kinds", kinds},
                 {"discretisation_error", numbers(errors)},
                 {"discretisation_error_from_elements", sim::finer_elements(r.elements)},
                 {"cut", {{"count", cut.count}, {"below", cut.below}, {"above", cut.above}}}};
    return json_document(json);
}

void write_products(const ModesOptions& a, const ModeReport& report) {
    OutputFolder folder(a.out, kModesProducts);
    write_file(folder.path("modes.json"), format_mode_json(report));
    if (a.frames) {
        std::filesystem::create_directory(folder.path("frames"));
        draw_modes(report.request, report.modes.basis, kMostPictures, folder.path("frames"),
                   folder.path("modes.png"));
    }
    folder.finish();
}

void run(const ModesOptions& a) {
    if (a.frames && a.out.empty()) refuse_options("--frames without --out", "--out DIR for the pictures");
    ModeReport report{request_of(a), a.shape, {}, {}};
    report.modes = sim::free_vibration_modes(report.request);
    report.errors = sim::discretisation_errors(report.request, report.modes);
    if (!a.out.empty()) write_products(a, report);
    fmt::print("{}", a.json ? format_mode_json(report) : format_mode_table(report));
    if (a.frames && !a.json) fmt::print("Pictures: {}/modes.png\n", a.out);
}

}  // namespace

void add_modes_command(Command& program) {
    Command command = program.command("modes", "Free vibration modes of a solid body");
    auto o = std::make_shared<ModesOptions>();
    sim::ModesRequest& request = o->request;
    request.elements = 1, request.count = kElementModes;
    command.required("--size", o->size, as::vector_of_3(as::number(kSmallest, 1000, "m")), "Full extents");
    command.required("--young", request.material.young_pa, as::number_above(0, 1e15, "Pa"),
                     "Young's modulus");
    command.required("--poisson", request.material.poisson, as::number_between(-1, 0.5),
                     "Poisson's ratio; rubber's is 0.49");
    command.required("--density", request.material.density_kg_m3, as::number_above(0, 1e6, "kg/m3"),
                     "Density");
    command.option("--shape", o->shape, as::choice({"box", "ellipsoid", "cylinder", "superquadric"}),
                   "What it is; a cylinder's axis is y");
    command.option("--exponents", o->exponents, as::vector_of_2(as::number(0.1, 1.9)),
                   "Of a superquadric: 0.1 makes edges, 1 is round, 1.9 pinched");
    command.option("--elements", request.elements, as::whole(1, kMostElements),
                   "Elements of 27 nodes per side");
    command.option("--count", request.count, as::whole(1, kMostModes), "Lowest modes that are not rigid");
    command.flag("--json", o->json, "Print one JSON document");
    command.option("--out", o->out, as::text("DIR"), "Folder for modes.json and pictures");
    command.flag("--frames", o->frames,
                 "Draw the lowest 75 mode shapes: frames/000001.png ..., and modes.png with all of them");
    command.runs([o] { run(*o); });
}

}  // namespace app
