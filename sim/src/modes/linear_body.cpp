#include "modes/linear_body.h"

#include <Eigen/Eigenvalues>
#include <cmath>

namespace sim {
namespace {

// Replaces the eigenvectors of each group of equal eigenvalues by the strain axes' projections onto the
// group's span.
void canonicalise(const Eigen::Vector3d& values, Eigen::Matrix3d& vectors) {
    for (int first = 0; first < 3;) {
        int end = first + 1;
        while (end < 3 && values[end] - values[first] < 1e-9 * values[2]) ++end;
        const Eigen::Matrix3d group = vectors;
        int filled = first;
        for (int axis = 0; axis < 3 && filled < end; ++axis) {
            Eigen::Vector3d v = Eigen::Vector3d::Zero();
            for (int k = first; k < end; ++k) v += group(axis, k) * group.col(k);
            for (int k = first; k < filled; ++k) v -= vectors.col(k).dot(v) * vectors.col(k);
            if (v.norm() > 1e-3) vectors.col(filled++) = v.normalized();
        }
        first = end;
    }
    for (int k = 0; k < 3; ++k) {
        const double top = vectors.col(k).cwiseAbs().maxCoeff();
        int largest = 0;  // the first of equals, whatever their last digits
        while (std::abs(vectors(largest, k)) < 0.999 * top) ++largest;
        if (vectors(largest, k) < 0) vectors.col(k) = -vectors.col(k);
    }
}

}  // namespace

VolumeMoments volume_moments(const Gauge& gauge) {
    const Eigen::Vector3d& s = gauge.semi_axes();
    const double e1 = gauge.e1(), e2 = gauge.e2(), scale = s.prod() * e1 * e2;
    const double polar = std::beta(e2 / 2, e2 / 2);
    const double flat = 0.5 * scale * std::beta(1.5 * e2, 0.5 * e2) * std::beta(0.5 * e1, 2 * e1 + 1);
    const double high = scale * polar * std::beta(1.5 * e1, e1 + 1);
    return {2 * scale * std::beta(e1 / 2 + 1, e1) * polar,
            Eigen::Vector3d(flat, high, flat).cwiseProduct(s.cwiseAbs2())};
}

LinearBody make_linear_body(const Gauge& gauge, const Material& material) {
    const VolumeMoments moments = volume_moments(gauge);
    const double mu = material.young_pa / (2 * (1 + material.poisson));
    const double lambda = 2 * mu * material.poisson / (1 - 2 * material.poisson);
    LinearBody body;
    body.mass = material.density_kg_m3 * moments.volume;
    body.moments = material.density_kg_m3 * moments.second;
    const Eigen::Vector3d& j = body.moments;
    Vector6d m;
    m << j, j.y() + j.z(), j.x() + j.z(), j.x() + j.y();

    const Eigen::Vector3d root = j.cwiseSqrt().cwiseInverse();
    Eigen::Matrix3d k = Eigen::Matrix3d::Constant(lambda);
    k.diagonal().array() += 2 * mu;
    const Eigen::Matrix3d scaled = moments.volume * root.asDiagonal() * k * root.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(scaled);
    Eigen::Matrix3d vectors = solver.eigenvectors();
    canonicalise(solver.eigenvalues(), vectors);

    body.omega << solver.eigenvalues().cwiseSqrt(),
        (4 * mu * moments.volume * m.tail<3>().cwiseInverse()).cwiseSqrt();
    body.strain_from_modal.setZero();
    body.strain_from_modal.topLeftCorner<3, 3>() = root.asDiagonal() * vectors;
    body.strain_from_modal.bottomRightCorner<3, 3>() = m.tail<3>().cwiseSqrt().cwiseInverse().asDiagonal();
    body.modal_from_strain = body.strain_from_modal.transpose() * m.asDiagonal();
    return body;
}

Vector6d strain_impulse(const Eigen::Vector3d& f, const Eigen::Vector3d& r) noexcept {
    Vector6d q;
    q << f.x() * r.x(), f.y() * r.y(), f.z() * r.z(), f.y() * r.z() + f.z() * r.y(),
        f.x() * r.z() + f.z() * r.x(), f.x() * r.y() + f.y() * r.x();
    return q;
}

}  // namespace sim
