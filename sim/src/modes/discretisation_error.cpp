#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "modes/finite_element.h"
#include "sim/modes.h"

namespace sim {
namespace {

using Eigenvalues = std::array<std::vector<double>, kParityClasses>;

constexpr int kFinestCount = 300, kOrder = 4;

// The elastic eigenvalues by class, ascending.
Eigenvalues by_class(const FreeVibrationModes& modes) {
    Eigenvalues result;
    for (Eigen::Index i = 6; i < modes.eigenvalues.size(); ++i)
        result[static_cast<std::size_t>(modes.parity[static_cast<std::size_t>(i)])].push_back(
            modes.eigenvalues[i]);
    return result;
}

// How many of each class's eigenvalues are among the lowest `count`.
std::array<std::size_t, kParityClasses> needed(const FreeVibrationModes& modes) {
    std::array<std::size_t, kParityClasses> result{};
    for (int i = 0; i < modes.basis.count(); ++i)
        ++result[static_cast<std::size_t>(modes.parity[static_cast<std::size_t>(6 + i)])];
    return result;
}

// A finer mesh has its counterparts in another order, and others between them.
Eigenvalues counterparts(ModesRequest request, const FreeVibrationModes& modes) {
    request.elements = finer_elements(request.elements);
    request.count = std::max(1, modes.basis.count());
    for (;;) {
        Eigenvalues found = by_class(free_vibration_modes(request));
        bool enough = true;
        for (std::size_t p = 0; p < kParityClasses; ++p) enough &= found[p].size() >= needed(modes)[p];
        if (enough || request.count == kFinestCount) return found;
        request.count = std::min(2 * request.count, kFinestCount);
    }
}

}  // namespace

int finer_elements(int elements) noexcept {
    return elements == 3 ? 6 : elements + 2;
}

Eigen::VectorXd discretisation_errors(const ModesRequest& request, const FreeVibrationModes& modes) {
    const Eigenvalues fine = counterparts(request, modes);
    const double refinement = static_cast<double>(finer_elements(request.elements)) / request.elements;
    const double share = 1 / (1 - std::pow(refinement, -kOrder));
    std::array<std::size_t, kParityClasses> next{};
    Eigen::VectorXd errors(modes.basis.count());
    for (int i = 0; i < modes.basis.count(); ++i) {
        const auto p = static_cast<std::size_t>(modes.parity[static_cast<std::size_t>(6 + i)]);
        const double coarse = modes.basis.omega[i] * modes.basis.omega[i];
        if (next[p] >= fine[p].size()) {
            errors[i] = std::numeric_limits<double>::quiet_NaN();
            continue;
        }
        const double finer = fine[p][next[p]++], limit = coarse - share * (coarse - finer);
        errors[i] = std::abs(std::sqrt(coarse / (limit > 0.5 * finer ? limit : finer)) - 1);
    }
    return errors;
}

}  // namespace sim
