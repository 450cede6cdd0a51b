#include "commands/mode_report.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace app {
namespace {

using Json = nlohmann::ordered_json;

double frequency_hz(double eigenvalue) {
    return std::sqrt(std::max(0.0, eigenvalue)) / (2 * M_PI);
}

int rows(const ModeReport& report) {
    return 6 + report.modes.basis.count();
}

std::string percent(double error) {
    return std::isfinite(error) ? fmt::format("{:.2g} %", 100 * error) : "unknown";
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

std::string table_row(const ModeReport& report, int mode) {
    const int at = 6 + mode;
    const double eigenvalue = report.modes.eigenvalues[at];
    return fmt::format("{:>4}  {:>14.6g}  {:>20.10g}  {:<11}  {:>10}\n", mode + 1, frequency_hz(eigenvalue),
                       eigenvalue, mode_kind(report.modes.parity[static_cast<std::size_t>(at)], false),
                       percent(report.errors[mode]));
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

Json numbers(const Eigen::Ref<const Eigen::VectorXd>& values) {
    Json list = Json::array();
    for (const double v : values) list.push_back(std::isfinite(v) ? Json(v) : Json());
    return list;
}

}  // namespace

ModeReport make_mode_report(const sim::ModesRequest& request, const std::string& shape) {
    ModeReport report{request, shape, sim::free_vibration_modes(request), {}};
    report.errors = sim::discretisation_errors(request, report.modes);
    return report;
}

std::string mode_kind(int parity, bool rigid) {
    static constexpr std::array<std::string_view, 8> kElastic = {
        "stretching", "bending x", "bending y", "shear xy", "bending z", "shear xz", "shear yz", "twisting"};
    static constexpr std::array<std::string_view, 8> kRigid = {
        "", "translation x", "translation y", "rotation z", "translation z", "rotation y", "rotation x", ""};
    return std::string((rigid ? kRigid : kElastic).at(static_cast<std::size_t>(parity)));
}

std::string format_mode_table(const ModeReport& report) {
    std::string text =
        heading(report) + "mode  frequency [Hz]  eigenvalue [rad2/s2]  kind              error\n";
    for (int i = 0; i < report.modes.basis.count(); ++i) text += table_row(report, i);
    return text + ending(report);
}

std::string format_mode_json(const ModeReport& report) {
    const sim::ModesRequest& r = report.request;
    const int n = rows(report);
    const Eigen::VectorXd eigenvalues = report.modes.eigenvalues.head(n);
    Eigen::VectorXd errors = Eigen::VectorXd::Zero(n);
    errors.tail(n - 6) = report.errors;
    Json kinds = Json::array();
    for (int i = 0; i < n; ++i)
        kinds.push_back(mode_kind(report.modes.parity[static_cast<std::size_t>(i)], i < 6));
    const sim::GroupCut& cut = report.modes.cut;
    const Eigen::VectorXd size = 2 * r.shape.semi_axes;
    Json json = {{"size_m", numbers(size)},
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
    return json.dump(2) + "\n";
}

}  // namespace app
