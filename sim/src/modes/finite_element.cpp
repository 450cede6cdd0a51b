#include "modes/finite_element.h"

#include <array>

#include "shape/quadratic_line.h"

namespace sim {
namespace {

constexpr int kNodes = 27;
constexpr double kVoidStiffness = 1e-8;

// Values of the 27 functions at local coordinates t, and slopes by component: column i in units of 1 / local
// coordinate.
struct BrickFunctions {
    Eigen::Matrix<double, kNodes, 1> value;
    Eigen::Matrix<double, kNodes, 3> slope;
};

BrickFunctions brick_functions(const Eigen::Vector3d& t) {
    const std::array<QuadraticLine, 3> line = {quadratic_line(t.x()), quadratic_line(t.y()),
                                               quadratic_line(t.z())};
    BrickFunctions f;
    for (int a = 0; a < kNodes; ++a) {
        const int i = a % 3, j = a / 3 % 3, k = a / 9;
        const double x = line[0].value[i], y = line[1].value[j], z = line[2].value[k];
        f.value[a] = x * y * z;
        f.slope.row(a) << line[0].slope[i] * y * z, x * line[1].slope[j] * z, x * y * line[2].slope[k];
    }
    return f;
}

// From the integrals g(27 i + a, 27 j + b) of dN_a/dx_i dN_b/dx_j.
Eigen::MatrixXd isotropic_stiffness(const Eigen::MatrixXd& g, const Material& material) {
    const double mu = material.young_pa / (2 * (1 + material.poisson));
    const double lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
    Eigen::MatrixXd k(3 * kNodes, 3 * kNodes);
    for (int a = 0; a < kNodes; ++a)
        for (int b = 0; b < kNodes; ++b) {
            double trace = 0;
            for (int i = 0; i < 3; ++i) trace += g(kNodes * i + a, kNodes * i + b);
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    k(3 * a + i, 3 * b + j) = lambda * g(kNodes * i + a, kNodes * j + b) +
                                              mu * g(kNodes * j + a, kNodes * i + b) +
                                              (i == j ? mu * trace : 0);
        }
    return k;
}

}  // namespace

FiniteElementModel::FiniteElementModel(const Superquadric& shape, ModeDomain domain, const Material& material,
                                       int elements)
    : half_extents_(shape.semi_axes), axis_{elements} {
    const double extent = 2 * half_extents_.maxCoeff();
    scale_ = material.young_pa / (material.density_kg_m3 * extent * extent);
    const bool whole = domain == ModeDomain::box, has_void = !whole && elements > 1;
    for (const CellRule& rule : whole ? box_rule(elements) : superquadric_rule(shape, elements))
        cells_.push_back(integrate(rule, material));
    if (!has_void) return;
    const OctantRule boxes = box_rule(elements);
    for (std::size_t c = 0; c < cells_.size(); ++c)
        cells_[c].stiffness +=
            kVoidStiffness * (integrate(boxes[c], material).stiffness - cells_[c].stiffness);
}

FiniteElementModel::CellMatrices FiniteElementModel::integrate(const CellRule& rule,
                                                               const Material& material) const {
    const Eigen::Index count = rule.weights.size();
    Eigen::MatrixXd values(count, kNodes), slopes(count, 3 * kNodes);
    for (Eigen::Index q = 0; q < count; ++q) {
        const BrickFunctions f = brick_functions(rule.points.col(q));
        values.row(q) = f.value.transpose();
        for (int i = 0; i < 3; ++i)
            slopes.row(q).segment<kNodes>(kNodes * i) =
                axis_.elements / half_extents_[i] * f.slope.col(i).transpose();
    }
    const Eigen::VectorXd weights = 8 * half_extents_.prod() * rule.weights;  // eight octants
    const Eigen::MatrixXd weighted = weights.asDiagonal() * slopes;
    return {isotropic_stiffness(slopes.transpose() * weighted, material),
            material.density_kg_m3 * values.transpose() * weights.asDiagonal() * values};
}

FiniteElementModel::Unknown FiniteElementModel::unknown(ParityClass parity, int component,
                                                        const Eigen::Array3i& node) const {
    const int k = axis_.elements;
    Unknown result{0, 1};
    for (int axis = 2; axis >= 0; --axis) {
        const bool odd = parity.odd(component, axis);
        const int side = node[axis] - k, from_plane = std::abs(side) - (odd ? 1 : 0);
        if (from_plane < 0) return {-1, 0};
        result.index = result.index * (odd ? k : k + 1) + from_plane;
        if (odd && side < 0) result.sign = -result.sign;
    }
    for (int before = 0; before < component; ++before) {
        int size = 1;
        for (int axis = 0; axis < 3; ++axis) size *= parity.odd(before, axis) ? k : k + 1;
        result.index += size;
    }
    return result;
}

int FiniteElementModel::unknowns(ParityClass parity) const {
    return unknown(parity, 2, Eigen::Array3i::Constant(2 * axis_.elements)).index + 1;
}

std::vector<FiniteElementModel::Unknown> FiniteElementModel::cell_unknowns(ParityClass parity,
                                                                           int cell) const {
    const int cells = axis_.cells();
    const Eigen::Array3i first(2 * axis_.element(cell % cells), 2 * axis_.element(cell / cells % cells),
                               2 * axis_.element(cell / cells / cells));
    std::vector<Unknown> result;
    for (int a = 0; a < kNodes; ++a)
        for (int i = 0; i < 3; ++i)
            result.push_back(unknown(parity, i, first + Eigen::Array3i(a % 3, a / 3 % 3, a / 9)));
    return result;
}

ParityProblem FiniteElementModel::problem(ParityClass parity) const {
    std::vector<Eigen::Triplet<double>> stiffness, mass;
    for (std::size_t c = 0; c < cells_.size(); ++c) {
        const std::vector<Unknown> at = cell_unknowns(parity, static_cast<int>(c));
        for (int b = 0; b < 3 * kNodes; ++b)
            for (int a = 0; a < 3 * kNodes; ++a) {
                if (at[a].index < 0 || at[b].index < 0) continue;
                const double sign = at[a].sign * at[b].sign;
                stiffness.emplace_back(at[a].index, at[b].index, sign * cells_[c].stiffness(a, b));
                if (a % 3 == b % 3)
                    mass.emplace_back(at[a].index, at[b].index, sign * cells_[c].mass(a / 3, b / 3));
            }
    }
    const int n = unknowns(parity);
    ParityProblem problem{Eigen::SparseMatrix<double>(n, n), Eigen::SparseMatrix<double>(n, n),
                          rigid_motion(parity)};
    problem.stiffness.setFromTriplets(stiffness.begin(), stiffness.end());
    problem.mass.setFromTriplets(mass.begin(), mass.end());
    return problem;
}

Eigen::VectorXd FiniteElementModel::rigid_motion(ParityClass parity) const {
    const std::array<int, kParityClasses> kinds = {0, 1, 1, 2, 1, 2, 2, 0};
    const int kind = kinds[parity.index], k = axis_.elements;
    if (kind == 0) return {};
    int first = 0, second = 2;  // the two axes of the rotation's plane
    while (!((parity.index >> first) & 1)) ++first;
    while (!((parity.index >> second) & 1)) --second;
    Eigen::VectorXd motion = Eigen::VectorXd::Zero(unknowns(parity));
    for (int node = 0; node < (k + 1) * (k + 1) * (k + 1); ++node) {
        const Eigen::Array3i at =
            k + Eigen::Array3i(node % (k + 1), node / (k + 1) % (k + 1), node / (k + 1) / (k + 1));
        const Eigen::Array3d r = (at - k).cast<double>() / k * half_extents_.array();
        const Unknown one = unknown(parity, first, at), other = unknown(parity, second, at);
        if (kind == 1) motion[one.index] = 1;
        if (kind == 2 && one.index >= 0) motion[one.index] = -r[second];
        if (kind == 2 && other.index >= 0) motion[other.index] = r[first];
    }
    return motion;
}

Eigen::VectorXd FiniteElementModel::expand(ParityClass parity, const Eigen::VectorXd& solution) const {
    const int m = 2 * axis_.elements + 1;
    Eigen::VectorXd nodal = Eigen::VectorXd::Zero(3 * m * m * m);
    for (int node = 0; node < m * m * m; ++node)
        for (int i = 0; i < 3; ++i) {
            const Unknown at = unknown(parity, i, Eigen::Array3i(node % m, node / m % m, node / m / m));
            if (at.index >= 0) nodal[3 * node + i] = at.sign * solution[at.index];
        }
    return nodal;
}

}  // namespace sim
