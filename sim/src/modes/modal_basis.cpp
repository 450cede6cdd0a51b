#include "modes/modal_basis.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "modes/linear_body.h"
#include "shape/quadratic_line.h"
#include "sim/modes.h"

namespace sim {
namespace {

constexpr int kLine = 9;  // three nodes' displacements

void make_positive(Eigen::Ref<Eigen::VectorXd> column) {
    const double top = column.cwiseAbs().maxCoeff();
    Eigen::Index largest = 0;
    while (std::abs(column[largest]) < 0.999 * top) ++largest;
    if (column[largest] < 0) column = -column;
}

Eigen::Matrix3d strain_matrix(const Vector6d& q) {
    Eigen::Matrix3d e;
    e << q[0], q[5], q[4], q[5], q[1], q[3], q[4], q[3], q[2];
    return e;
}

/// The element that holds a point, with its functions there.
struct Located {
    Eigen::Index first_node;
    Eigen::Index nodes_a_line;          ///< of the whole grid
    std::array<QuadraticLine, 3> line;  ///< slopes in 1/m
};

inline Located locate_in(const ModalBasis& basis, const Eigen::Vector3d& r) noexcept {
    const Eigen::Index m = 2 * basis.elements + 1;
    Located at{0, m, {}};
    Eigen::Index stride = 1;
    const Eigen::Vector3d inverse = basis.half_extents.cwiseInverse();
    for (int i = 0; i < 3; ++i, stride *= m) {
        const ElementPlace place = locate(r[i] * inverse[i], basis.elements);
        at.line[i] = quadratic_line(place.local);
        at.line[i].slope *= place.at_border ? 0 : basis.elements * inverse[i];
        at.first_node += 2 * place.element * stride;
    }
    return at;
}

Eigen::Matrix3d inverse_of(const Eigen::Matrix3d& gradient) noexcept {
    return (Eigen::Matrix3d::Identity() + gradient).inverse();
}

}  // namespace

void make_canonical(Eigen::MatrixXd& span) {
    const Eigen::Index n = span.cols();
    if (n > 1) {
        // Row j of `span` holds the coordinates of the response to a unit force on nodal axis j.
        Eigen::MatrixXd turn(n, n);
        const double longest = span.rowwise().norm().maxCoeff();
        Eigen::Index filled = 0;
        for (Eigen::Index j = 0; j < span.rows() && filled < n; ++j) {
            Eigen::VectorXd v = span.row(j).transpose();
            for (int pass = 0; pass < 2; ++pass)
                for (Eigen::Index k = 0; k < filled; ++k) v -= turn.col(k).dot(v) * turn.col(k);
            if (v.norm() > 1e-2 * longest) turn.col(filled++) = v.normalized();
        }
        if (filled == n) span = (span * turn).eval();
    }
    for (Eigen::Index k = 0; k < n; ++k) make_positive(span.col(k));
}

ModalBasis uniform_strain_basis(const Superquadric& shape, const Material& material) {
    const LinearBody body = make_linear_body(Gauge(shape), material);
    std::array<int, 6> order;
    std::iota(order.begin(), order.end(), 0);
    // Equal ones, whatever their last digits, stay in LinearBody's order: insertion sort.
    for (int i = 1; i < 6; ++i)
        for (int j = i; j > 0 && body.omega[order[j]] < body.omega[order[j - 1]] * (1 - 1e-9); --j)
            std::swap(order[j], order[j - 1]);
    ModalBasis basis;
    basis.half_extents = shape.semi_axes;
    basis.omega.resize(6);
    basis.nodal.resize(81, 6);
    for (int k = 0; k < 6; ++k) {
        basis.omega[k] = body.omega[order[k]];
        const Eigen::Matrix3d strain = strain_matrix(body.strain_from_modal.col(order[k]));
        for (int a = 0; a < 27; ++a) {
            const Eigen::Vector3d node(a % 3 - 1, a / 3 % 3 - 1, a / 9 - 1);
            basis.nodal.block<3, 1>(3 * a, k) = strain * node.cwiseProduct(shape.semi_axes);
        }
        make_positive(basis.nodal.col(k));
    }
    std::sort(basis.omega.begin(), basis.omega.end());
    return basis;
}

RigidMass rigid_mass(const Superquadric& shape, const Material& material) {
    const VolumeMoments moments = volume_moments(Gauge(shape));
    const Eigen::Vector3d j = material.density_kg_m3 * moments.second;
    return {material.density_kg_m3 * moments.volume, Eigen::Vector3d::Constant(j.sum()) - j};
}

Eigen::Matrix3Xd mode_shapes_at(const ModalBasis& basis, const Eigen::Vector3d& r) {
    if (basis.count() == 0) return Eigen::Matrix3Xd(3, 0);  // a rigid body has no nodes either
    const Located at = locate_in(basis, r);
    const Eigen::Index m = at.nodes_a_line;
    Eigen::Matrix3Xd shapes = Eigen::Matrix3Xd::Zero(3, basis.count());
    for (int a = 0; a < 27; ++a) {
        const int i = a % 3, j = a / 3 % 3, k = a / 9;
        const double weight = at.line[0].value[i] * at.line[1].value[j] * at.line[2].value[k];
        shapes += weight * basis.nodal.middleRows<3>(3 * (at.first_node + i + m * (j + m * k)));
    }
    return shapes;
}

// Contracts the element's 3 x 3 x 3 nodes along z, y, then x: 280 products. Plain loops over lines of nine
// (three nodes), which the compiler turns into vectors; Eigen leaves nine doubles scalar.
Displacement displacement_at(const ModalBasis& basis, const Eigen::Ref<const Eigen::VectorXd>& nodal,
                             const Eigen::Vector3d& r) noexcept {
    const Located at = locate_in(basis, r);
    const Eigen::Index m = at.nodes_a_line;
    double value[kLine] = {}, along_y[kLine] = {}, along_z[kLine] = {};
    for (int j = 0; j < 3; ++j) {
        const double* near = nodal.data() + 3 * (at.first_node + m * j);
        const double *middle = near + 3 * m * m, *far = middle + 3 * m * m;
        const Eigen::Vector3d &z = at.line[2].value, &z_slope = at.line[2].slope;
        const double y = at.line[1].value[j], y_slope = at.line[1].slope[j];
        for (int i = 0; i < kLine; ++i) {
            const double line = z[0] * near[i] + z[1] * middle[i] + z[2] * far[i];
            const double slope = z_slope[0] * near[i] + z_slope[1] * middle[i] + z_slope[2] * far[i];
            value[i] += y * line;
            along_y[i] += y_slope * line;
            along_z[i] += y * slope;
        }
    }
    Displacement result;
    using Nodes = Eigen::Map<const Eigen::Matrix3d>;
    result.value = Nodes(value) * at.line[0].value;
    result.gradient.col(0) = Nodes(value) * at.line[0].slope;
    result.gradient.col(1) = Nodes(along_y) * at.line[0].value;
    result.gradient.col(2) = Nodes(along_z) * at.line[0].value;
    return result;
}

namespace {

constexpr int kNewtonSteps = 20, kHalvings = 8, kFixedPointSteps = 200;
constexpr double kConverged = 1e-12;

/// A place of the iteration with its residual r + u(r) - x.
struct Trial {
    Eigen::Vector3d r, residual;
    Eigen::Matrix3d gradient;
};

Trial try_at(const ModalBasis& basis, const Eigen::Ref<const Eigen::VectorXd>& nodal,
             const Eigen::Vector3d& x, const Eigen::Vector3d& r) noexcept {
    const Displacement u = displacement_at(basis, nodal, r);
    return {r, r + u.value - x, u.gradient};
}

// Halves the step until the residual falls; the last trial if it never does.
Trial newton_step(const ModalBasis& basis, const Eigen::Ref<const Eigen::VectorXd>& nodal,
                  const Eigen::Vector3d& x, const Trial& from) noexcept {
    const Eigen::Vector3d step = inverse_of(from.gradient) * from.residual;
    double share = 1;
    Trial next = try_at(basis, nodal, x, from.r - step);
    for (int i = 0; i < kHalvings && !(next.residual.squaredNorm() < from.residual.squaredNorm()); ++i)
        next = try_at(basis, nodal, x, from.r - (share *= 0.5) * step);
    return next;
}

}  // namespace

InversePoint inverse_displacement(const ModalBasis& basis, const Eigen::Ref<const Eigen::VectorXd>& nodal,
                                  const Eigen::Vector3d& x) noexcept {
    const double tolerance = kConverged * 2 * basis.half_extents.maxCoeff();
    Trial at = try_at(basis, nodal, x, x), best = at;
    int iterations = 0;
    while (iterations < kNewtonSteps && !(at.residual.norm() <= tolerance)) {
        at = newton_step(basis, nodal, x, at);
        ++iterations;
        if (at.residual.squaredNorm() < best.residual.squaredNorm()) best = at;
    }
    if (at.residual.norm() <= tolerance) return {at.r, at.gradient, iterations, false};
    at = best;
    for (int i = 0; i < kFixedPointSteps && best.residual.norm() > tolerance; ++i, ++iterations) {
        at = try_at(basis, nodal, x, at.r - 0.5 * at.residual);
        if (at.residual.squaredNorm() < best.residual.squaredNorm()) best = at;
    }
    return {best.r, best.gradient, iterations, true};
}

}  // namespace sim
