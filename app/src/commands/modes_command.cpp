#include "commands/modes_command.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "commands/mode_report.h"
#include "files/bad_input.h"
#include "files/comma_list.h"
#include "files/option_values.h"
#include "files/output_folder.h"
#include "pictures/mode_pictures.h"

namespace app {
namespace {

constexpr int kMostElements = 10, kMostModes = 150, kElementModes = 75, kMostPictures = 75;
constexpr double kSmallest = 1e-6;  // a size [m]

struct ModesArguments {
    std::string size, young, poisson, density, shape = "box", exponents, elements = "1", count, out;
    bool json = false, frames = false;
};

/// A shape by name; without exponents they must be given.
struct NamedShape {
    std::string_view name;
    double e1, e2;
};
constexpr std::array<NamedShape, 4> kShapes = {
    {{"box", 0.1, 0.1}, {"ellipsoid", 1, 1}, {"cylinder", 0.1, 1}, {"superquadric", 0, 0}}};

const NamedShape& shape_named(const std::string& name) {
    for (const NamedShape& shape : kShapes)
        if (shape.name == name) return shape;
    throw BadInput(fmt::format(
        "error: found --shape \"{}\", expected box, ellipsoid, cylinder (its axis is y) or superquadric",
        name));
}

double number_in(const std::string& text, const std::string& option, double low, double high,
                 const std::string& expected) {
    const double value = parse_number(text, option);
    if (!(value > low && value < high))
        throw BadInput(fmt::format("error: found {} {}, expected {}", option, text, expected));
    return value;
}

void set_exponents(sim::Superquadric& shape, const NamedShape& named, const std::string& exponents) {
    const bool free = named.name == "superquadric";
    if (free == exponents.empty())
        throw BadInput(
            free ? std::string("error: found --shape superquadric alone, expected --exponents E1,E2 "
                               "with it, such as 0.5,1")
                 : fmt::format("error: found --exponents with --shape {}, expected them with --shape "
                               "superquadric only; leave one out",
                               named.name));
    shape.e1 = named.e1;
    shape.e2 = named.e2;
    if (!free) return;
    const std::vector<std::string> parts = split_at_commas(exponents);
    if (parts.size() != 2)
        throw BadInput(fmt::format("error: found --exponents \"{}\", expected two numbers E1,E2", exponents));
    const std::string expected = "each exponent from 0.1 (edges) by 1 (round) to 1.9 (pinched)";
    shape.e1 = number_in(parts[0], "--exponents", 0.1 - 1e-12, 1.9 + 1e-12, expected);
    shape.e2 = number_in(parts[1], "--exponents", 0.1 - 1e-12, 1.9 + 1e-12, expected);
}

sim::ModesRequest request_of(const ModesArguments& a) {
    sim::ModesRequest request;
    const NamedShape& shape = shape_named(a.shape);
    const Eigen::Vector3d size = parse_vector(a.size, "--size");
    if (!(size.minCoeff() >= kSmallest))
        throw BadInput(fmt::format("error: found --size {}, expected full extents from {:g} to 1000 m",
                                   a.size, kSmallest));
    request.shape.semi_axes = size / 2;
    set_exponents(request.shape, shape, a.exponents);
    request.domain = shape.name == "box" ? sim::ModeDomain::box : sim::ModeDomain::superquadric;
    request.material.young_pa = number_in(a.young, "--young", 0, 1e15, "more than 0 Pa, at most 1e15");
    request.material.poisson =
        number_in(a.poisson, "--poisson", -1, 0.5, "more than -1 and less than 0.5; rubber is 0.49");
    request.material.density_kg_m3 =
        number_in(a.density, "--density", 0, 1e6, "more than 0 kg/m3, at most 1e6");
    request.elements = parse_whole(a.elements, "--elements", 1, kMostElements);
    request.count = a.count.empty() ? kElementModes : parse_whole(a.count, "--count", 1, kMostModes);
    return request;
}

void write_products(const ModesArguments& a, const ModeReport& report) {
    OutputFolder folder(a.out, modes_products());
    write_file(folder.path("modes.json"), format_mode_json(report));
    if (a.frames) {
        std::filesystem::create_directory(folder.path("frames"));
        ModePictures(report.request, report.modes.basis, kMostPictures)
            .write(folder.path("frames"), folder.path("modes.png"));
    }
    folder.finish();
}

void run(const ModesArguments& a) {
    if (a.frames && a.out.empty())
        throw BadInput("error: found --frames without --out, expected --out DIR for the pictures");
    const ModeReport report = make_mode_report(request_of(a), a.shape);
    if (!a.out.empty()) write_products(a, report);
    fmt::print("{}", a.json ? format_mode_json(report) : format_mode_table(report));
    if (a.frames && !a.json) fmt::print("Pictures: {}/modes.png\n", a.out);
}

}  // namespace

void add_modes_command(CLI::App& program) {
    CLI::App* command = program.add_subcommand("modes", "Free vibration modes of a solid body");
    auto a = std::make_shared<ModesArguments>();
    command->add_option("--size", a->size, "Full extents X,Y,Z [m]")->required();
    command->add_option("--young", a->young, "Young's modulus [Pa]")->required();
    command->add_option("--poisson", a->poisson, "Poisson's ratio, above -1 and below 0.5")->required();
    command->add_option("--density", a->density, "Density [kg/m3]")->required();
    command->add_option("--shape", a->shape, "box, ellipsoid, cylinder (its axis is y) or superquadric")
        ->capture_default_str();
    command->add_option("--exponents", a->exponents, "E1,E2 of a superquadric, 0.1 to 1.9");
    command->add_option("--elements", a->elements, "Elements of 27 nodes a side, to 10")
        ->capture_default_str();
    command->add_option("--count", a->count, "Lowest modes that are not rigid, to 150; left out: 75");
    command->add_flag("--json", a->json, "Print one JSON document");
    command->add_option("--out", a->out, "Folder for modes.json and pictures");
    command->add_flag(
        "--frames", a->frames,
        "Draw the lowest 75 mode shapes: frames/000001.png ..., and modes.png with all of them");
    command->callback([a] { run(*a); });
}

}  // namespace app
