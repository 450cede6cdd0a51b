#include "body/posed_body.h"

#include <algorithm>
#include <cmath>

#include "shape/shape_polynomial.h"

namespace sim {
namespace {

float largest(Lanes v) {
    float top = v[0];
    for (int i = 1; i < kLanes; ++i) top = v[i] > top ? v[i] : top;
    return top;
}

Lanes larger(Lanes a, Lanes b) {
    return a > b ? a : b;
}

}  // namespace

void PosedBody::set(const Eigen::Vector3d& at, const Eigen::Quaterniond& orientation,
                    const Eigen::VectorXd& q) {
    position = at;
    rotation = orientation.toRotationMatrix();
    half_box = kind->half_box.cast<float>();
    radius = static_cast<float>(kind->surface.bounding_radius());
    sample_reach = 0;
    if (kind->linear()) {
        deform_linear(q);
    } else {  // may have been another, linear body before
        deformation.setIdentity(), deformation_inverse.setIdentity();
        if (kind->modes > 0) deform_modal(q);
    }
    half_aabb = (rotation.cwiseAbs() * half_box.cast<double>()).cwiseMin(radius);
}

void PosedBody::deform_linear(const Eigen::VectorXd& q) {
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
    sample_reach =
        static_cast<float>((d - Eigen::Matrix3d::Identity()).norm() * kind->surface.bounding_radius());
    half_box.array() += sample_reach;
    radius += sample_reach;
}

void PosedBody::deform_modal(const Eigen::VectorXd& q) {
    const int padded = kind->batches * kLanes, modes = kind->modes;
    alignas(32) float coordinates[kMostModes];
    for (int k = 0; k < modes; ++k) coordinates[k] = static_cast<float>(q[k]);
    samples.resize(3 * padded);
    Lanes furthest = lanes_of(0), far = lanes_of(0), box[3] = {far, far, far};
    for (int s = 0; s < padded; s += kLanes) {
        Lanes u[3] = {lanes_of(0), lanes_of(0), lanes_of(0)};
        const float* shape = kind->shapes.data() + s;
        for (int k = 0; k < modes; ++k, shape += 3 * padded) {
            const Lanes z = lanes_of(coordinates[k]);
            for (int i = 0; i < 3; ++i) u[i] += z * load_lanes(shape + i * padded);
        }
        furthest = larger(furthest, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        for (int i = 0; i < 3; ++i) {
            u[i] += load_lanes(kind->rest.data() + i * padded + s);
            box[i] = larger(box[i], larger(u[i], -u[i]));
            store_lanes(samples.data() + i * padded + s, u[i]);
        }
        far = larger(far, u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
    }
    bend_polynomial(coordinates);
    sample_reach = std::sqrt(largest(furthest));
    // Samples stand for the surface between them: a quarter of the displacement more.
    for (int i = 0; i < 3; ++i)
        half_box[i] += std::max(largest(box[i]) - kind->sample_box[i], 0.f) + sample_reach / 4;
    radius += std::max(std::sqrt(largest(far)) - kind->sample_radius, 0.f) + sample_reach / 4;
}

void PosedBody::bend_polynomial(const float* q) {
    const int rows = whole_lanes(kind->bricks * kind->bricks * kind->bricks * 81);
    polynomial.resize(rows);
    for (int row = 0; row < rows; row += kLanes) {
        const float* c = kind->mode_polynomials.data() + row;
        Lanes sum = lanes_of(0);
        for (int k = 0; k < kind->modes; ++k, c += rows) sum += lanes_of(q[k]) * load_lanes(c);
        store_lanes(polynomial.data() + row, sum);
    }
}

std::pair<int, float> PosedBody::furthest_sample(const Eigen::Vector3f& direction) const noexcept {
    const float* x = sample_data();
    const int stride = kind->batches * kLanes;
    const Lanes d[3] = {lanes_of(direction[0]), lanes_of(direction[1]), lanes_of(direction[2])};
    Lanes top = lanes_of(-1e30f);
    LaneMask place{}, at = {0, 1, 2, 3, 4, 5, 6, 7};
    for (int i = 0; i < stride; i += kLanes, at += kLanes) {
        const Lanes reach = d[0] * load_lanes(x + i) + d[1] * load_lanes(x + stride + i) +
                            d[2] * load_lanes(x + 2 * stride + i);
        const LaneMask more = reach > top;
        top = more ? reach : top;
        place = more ? at : place;
    }
    std::pair<int, float> best{place[0], top[0]};
    for (int lane = 1; lane < kLanes; ++lane)
        if (top[lane] > best.second || (top[lane] == best.second && place[lane] < best.first))
            best = {place[lane], top[lane]};
    return best;
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
