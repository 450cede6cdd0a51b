#include "posed_body.h"

#include <cmath>

#include "shape_polynomial.h"

namespace sim {
namespace {

float largest(Lanes v) {
    float top = v[0];
    for (int i = 1; i < kLanes; ++i) top = v[i] > top ? v[i] : top;
    return top;
}

}  // namespace

void PosedBody::set(const Eigen::Vector3d& at, const Eigen::Quaterniond& orientation,
                    const Eigen::VectorXd& q) {
    position = at;
    rotation = orientation.toRotationMatrix();
    const float reach = kind->modes == 0 ? 0 : kind->linear() ? deform_linear(q) : deform_modal(q);
    half_box = kind->half_box.cast<float>().array() + reach;
    radius = static_cast<float>(kind->bounding_radius) + reach;
    half_aabb = (rotation.cwiseAbs() * half_box.cast<double>()).cwiseMin(radius);
}

float PosedBody::deform_linear(const Eigen::VectorXd& q) {
    // Column j of du/dr is the polynomial's linear coefficient along axis j (rows 1, 3 and 9).
    Eigen::Matrix3d d = Eigen::Matrix3d::Identity();
    const int stride = kind->mode_width;
    constexpr int kLinearRow[3] = {1, 3, 9};
    for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i) {
            const float* row = kind->polynomials.data() + (3 * kLinearRow[j] + i) * stride;
            double sum = 0;
            for (int k = 0; k < kind->modes; ++k) sum += static_cast<double>(row[k]) * q[k];
            d(i, j) += sum / kind->basis.half_extents[j];
        }
    deformation = d.cast<float>();
    deformation_inverse = d.inverse().cast<float>();
    const int padded = kind->batches * kLanes;
    samples.resize(3 * padded);
    const float* rest = kind->rest.data();
    for (int i = 0; i < 3; ++i) {
        const Lanes dx = lanes_of(deformation(i, 0)), dy = lanes_of(deformation(i, 1)),
                    dz = lanes_of(deformation(i, 2));
        for (int s = 0; s < padded; s += kLanes)
            store_lanes(samples.data() + i * padded + s, dx * load_lanes(rest + s) +
                                                             dy * load_lanes(rest + padded + s) +
                                                             dz * load_lanes(rest + 2 * padded + s));
    }
    return static_cast<float>((d - Eigen::Matrix3d::Identity()).norm() * kind->bounding_radius);
}

float PosedBody::deform_modal(const Eigen::VectorXd& q) {
    const int padded = kind->batches * kLanes, modes = kind->modes;
    samples.resize(3 * padded);
    Lanes furthest = lanes_of(0);
    for (int s = 0; s < padded; s += kLanes) {
        Lanes ux = lanes_of(0), uy = lanes_of(0), uz = lanes_of(0);
        const float* shape = kind->shapes.data() + s;
        for (int k = 0; k < modes; ++k, shape += 3 * padded) {
            const Lanes z = lanes_of(static_cast<float>(q[k]));
            ux += z * load_lanes(shape);
            uy += z * load_lanes(shape + padded);
            uz += z * load_lanes(shape + 2 * padded);
        }
        const Lanes square = ux * ux + uy * uy + uz * uz;
        furthest = square > furthest ? square : furthest;
        store_lanes(samples.data() + s, load_lanes(kind->rest.data() + s) + ux);
        store_lanes(samples.data() + padded + s, load_lanes(kind->rest.data() + padded + s) + uy);
        store_lanes(samples.data() + 2 * padded + s, load_lanes(kind->rest.data() + 2 * padded + s) + uz);
    }
    const int width = kind->mode_width, rows = kind->bricks * kind->bricks * kind->bricks * 81;
    polynomial.resize(rows);
    alignas(32) float coordinates[2 * 128];
    for (int k = 0; k < width; ++k) coordinates[k] = k < modes ? static_cast<float>(q[k]) : 0;
    for (int row = 0; row < rows; ++row) {
        const float* c = kind->polynomials.data() + static_cast<std::size_t>(row) * width;
        Lanes sum = lanes_of(0);
        for (int k = 0; k < width; k += kLanes) sum += load_lanes(c + k) * load_lanes(coordinates + k);
        polynomial.data()[row] = sum_of(sum);
    }
    // Samples stand for the surface between them: a quarter more.
    return 1.25f * std::sqrt(largest(furthest));
}

Eigen::Vector3d PosedBody::deformed(const Eigen::Vector3d& rest) const noexcept {
    if (kind->modes == 0) return rest;
    if (kind->linear()) return deformation.cast<double>() * rest;
    const BodyKind::Local local = kind->locate(rest.cast<float>());
    const PolynomialValue<float> p = evaluate_polynomial<float>(polynomial.data() + 81 * local.brick,
                                                                local.xi.x(), local.xi.y(), local.xi.z());
    return rest + Eigen::Vector3d(p.u[0], p.u[1], p.u[2]);
}

}  // namespace sim
