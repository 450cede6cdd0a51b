#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "finite_element.h"
#include "sim/modes.h"

namespace sim {
namespace {

using Eigen::Vector3d;

const Material kUnit{1, 0.3, 1};

ModesRequest box(const Vector3d& size, int elements, int count, const Material& material = kUnit) {
    return {{size / 2, 0.1, 0.1}, ModeDomain::box, material, elements, count};
}

/// reference/free_vibration_modes.json of MUSICWORLD_SHARED; null without it.
nlohmann::json reference() {
    const char* shared = std::getenv("MUSICWORLD_SHARED");
    if (shared == nullptr) return nullptr;
    std::ifstream file(std::string(shared) + "/reference/free_vibration_modes.json");
    return file ? nlohmann::json::parse(file) : nlohmann::json(nullptr);
}

struct ReferenceBox {
    const char* name;
    Vector3d size;
};
const ReferenceBox kReferenceBoxes[] = {{"cube_nu0.3", {1, 1, 1}}, {"box123_nu0.3", {1, 2, 3}}};

/// Largest relative difference of the elastic eigenvalues, as many as are listed.
double worst_difference(const Eigen::VectorXd& found, const std::vector<double>& listed) {
    double worst = 0;
    for (std::size_t i = 6; i < listed.size(); ++i)
        worst = std::max(worst, std::abs(found[static_cast<Eigen::Index>(i)] / listed[i] - 1));
    return worst;
}

void expect_rigid(const Eigen::VectorXd& eigenvalues) {
    const double largest = eigenvalues[eigenvalues.size() - 1];
    EXPECT_LT(eigenvalues.head<6>().cwiseAbs().maxCoeff(), 1e-12 * largest);
}

TEST(VibrationModes, AllEigenvaluesOfOneElementMatchTheReferenceTo1em9) {
    const nlohmann::json listed = reference();
    if (listed.is_null()) GTEST_SKIP() << "needs MUSICWORLD_SHARED";
    for (const ReferenceBox& b : kReferenceBoxes) {
        const FreeVibrationModes modes = free_vibration_modes(box(b.size, 1, -1));
        ASSERT_EQ(modes.eigenvalues.size(), 81);
        EXPECT_LT(worst_difference(modes.eigenvalues, listed[b.name]["eigenvalues"]), 1e-9) << b.name;
        expect_rigid(modes.eigenvalues);
    }
}

TEST(VibrationModes, EigenvaluesOf2And4And6ElementsASideMatchTheReferenceTo1em9) {
    const nlohmann::json listed = reference();
    if (listed.is_null()) GTEST_SKIP() << "needs MUSICWORLD_SHARED";
    for (const ReferenceBox& b : kReferenceBoxes)
        for (const int k : {2, 4, 6}) {
            const FreeVibrationModes modes = free_vibration_modes(box(b.size, k, 18));
            const std::string mesh =
                "mesh_" + std::to_string(k) + "x" + std::to_string(k) + "x" + std::to_string(k);
            ASSERT_GE(modes.eigenvalues.size(), 24);
            EXPECT_LT(worst_difference(modes.eigenvalues, listed[b.name][mesh]), 1e-9) << b.name << mesh;
            expect_rigid(modes.eigenvalues);
        }
}

}  // namespace
}  // namespace sim
