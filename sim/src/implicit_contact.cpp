#include "implicit_contact.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "shape_polynomial.h"

namespace sim {
namespace {

constexpr int kNewtonSteps = 6;
constexpr float kResidual = 1e-4f;  // share of the size

Lanes absolute(Lanes a) {
    return a < 0 ? -a : a;
}
Lanes square_root(Lanes a) {
#ifdef __AVX__
    return _mm256_sqrt_ps(a);
#else
    for (int i = 0; i < kLanes; ++i) a[i] = std::sqrt(a[i]);
    return a;
#endif
}
// A bit a lane.
int bits(LaneMask mask) {
#ifdef __AVX__
    return _mm256_movemask_ps(reinterpret_cast<__m256>(mask));
#else
    int result = 0;
    for (int i = 0; i < kLanes; ++i) result |= mask[i] ? 1 << i : 0;
    return result;
#endif
}
bool any(LaneMask mask) {
    return bits(mask) != 0;
}

// Inverse of F = I + G, by cofactors.
template <typename T>
struct Inverse {
    T m[3][3];
};
template <typename T>
Inverse<T> inverse_of(const T (&g)[3][3]) {
    const T a = g[0][0] + 1, b = g[0][1], c = g[0][2], d = g[1][0], e = g[1][1] + 1, f = g[1][2], h = g[2][0],
            i = g[2][1], j = g[2][2] + 1;
    const T p = e * j - f * i, q = f * h - d * j, r = d * i - e * h;
    const T scale = 1 / (a * p + b * q + c * r);
    return {{{p * scale, (c * i - b * j) * scale, (b * f - c * e) * scale},
             {q * scale, (a * j - c * h) * scale, (c * d - a * f) * scale},
             {r * scale, (b * h - a * i) * scale, (a * e - b * d) * scale}}};
}

}  // namespace

/// Eight points on their way from the deformed frame to the rest shape.
struct SampleFinder::Batch {
    Lanes x[3];           // deformed
    Lanes r[3];           // at rest
    Lanes inverse[3][3];  // F^-1 there
    int count;
};

void SampleFinder::find(const PosedBody& sampled, const PosedBody& implicit, float margin,
                        std::vector<SampleContact>& found) {
    gather(sampled, implicit, margin);
    const BodyKind& kind = *implicit.kind;
    const Eigen::Vector3f axes = kind.definition.shape.base.semi_axes.cast<float>();
    for (std::size_t first = 0; first < near_.size(); first += kLanes) {
        Batch batch;
        batch.count = static_cast<int>(std::min<std::size_t>(kLanes, near_.size() - first));
        for (int i = 0; i < 3; ++i) batch.x[i] = load_lanes(near_place_.data() + i * capacity_ + first);
        invert(implicit, batch);
        Lanes value, g[3];
        if (kind.ellipsoid) {
            Lanes u[3];
            for (int i = 0; i < 3; ++i) u[i] = batch.r[i] / axes[i];
            const Lanes n = square_root(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
            value = n - 1;
            const Lanes safe = n < 1e-6f ? lanes_of(1e-6f) : n;
            for (int i = 0; i < 3; ++i) g[i] = u[i] / (safe * axes[i]);
        } else {
            for (int lane = 0; lane < kLanes; ++lane) {
                const SurfacePoint s = kind.surface.distance(
                    Eigen::Vector3d(batch.r[0][lane], batch.r[1][lane], batch.r[2][lane]));
                value[lane] = static_cast<float>(s.distance);
                for (int i = 0; i < 3; ++i) g[i][lane] = static_cast<float>(s.normal[i]);
                if (lane + 1 >= batch.count) break;
            }
        }
        Lanes normal[3];
        for (int i = 0; i < 3; ++i)
            normal[i] = batch.inverse[0][i] * g[0] + batch.inverse[1][i] * g[1] + batch.inverse[2][i] * g[2];
        const Lanes steep =
            square_root(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
        for (int lane = 0; lane < batch.count; ++lane) {
            SampleContact contact;
            contact.sample = near_[first + static_cast<std::size_t>(lane)];
            contact.rest = {batch.r[0][lane], batch.r[1][lane], batch.r[2][lane]};
            if (steep[lane] > 1e-6f) {
                contact.separation = value[lane] / steep[lane];
                contact.normal =
                    Eigen::Vector3f(normal[0][lane], normal[1][lane], normal[2][lane]) / steep[lane];
            } else {  // at the centre every direction is as good: out by the way the sampled body is
                const Eigen::Vector3d out =
                    implicit.rotation.transpose() * (sampled.position - implicit.position);
                contact.separation = -axes.minCoeff();
                contact.normal = out.norm() > 1e-9 ? Eigen::Vector3f(out.normalized().cast<float>())
                                                   : Eigen::Vector3f::UnitY();
            }
            if (contact.separation < margin) found.push_back(contact);
        }
    }
}

void SampleFinder::gather(const PosedBody& sampled, const PosedBody& implicit, float margin) {
    const int stride = sampled.kind->batches * kLanes, samples = sampled.kind->samples;
    if (capacity_ < static_cast<std::size_t>(stride + kLanes)) {
        capacity_ = static_cast<std::size_t>(stride + kLanes);
        near_place_.resize(3 * capacity_);
        near_.reserve(capacity_);
    }
    near_.clear();
    const Eigen::Matrix3f turn = (implicit.rotation.transpose() * sampled.rotation).cast<float>();
    const Eigen::Vector3f shift =
        (implicit.rotation.transpose() * (sampled.position - implicit.position)).cast<float>();
    const Eigen::Vector3f box = implicit.half_box.array() + margin;
    const float ball = (implicit.radius + margin) * (implicit.radius + margin);
    const float* data = sampled.sample_data();
    for (int first = 0; first < stride; first += kLanes) {
        const Lanes a = load_lanes(data + first), b = load_lanes(data + stride + first),
                    c = load_lanes(data + 2 * stride + first);
        Lanes x[3];
        for (int i = 0; i < 3; ++i) x[i] = turn(i, 0) * a + turn(i, 1) * b + turn(i, 2) * c + shift[i];
        const LaneMask inside = (absolute(x[0]) < box[0]) & (absolute(x[1]) < box[1]) &
                                (absolute(x[2]) < box[2]) & (x[0] * x[0] + x[1] * x[1] + x[2] * x[2] < ball);
        for (unsigned left = static_cast<unsigned>(bits(inside)); left != 0; left &= left - 1) {
            const int lane = std::countr_zero(left);
            if (first + lane >= samples) break;
            for (int i = 0; i < 3; ++i) near_place_.data()[i * capacity_ + near_.size()] = x[i][lane];
            near_.push_back(first + lane);
        }
    }
    for (std::size_t pad = near_.size(); pad % kLanes != 0; ++pad)
        for (int i = 0; i < 3; ++i)
            near_place_.data()[i * capacity_ + pad] = near_place_.data()[i * capacity_ + near_.size() - 1];
}

void SampleFinder::invert(const PosedBody& implicit, Batch& batch) {
    if (implicit.kind->modes > 0 && !implicit.kind->linear()) {
        if (implicit.kind->bricks == 1) {
            invert_polynomial(implicit, batch);
        } else {
            invert_bricks(implicit, batch);
        }
        return;
    }
    const Eigen::Matrix3f& d = implicit.deformation_inverse;
    for (int i = 0; i < 3; ++i) {
        batch.r[i] = d(i, 0) * batch.x[0] + d(i, 1) * batch.x[1] + d(i, 2) * batch.x[2];
        for (int j = 0; j < 3; ++j) batch.inverse[i][j] = lanes_of(d(i, j));
    }
}

void SampleFinder::invert_polynomial(const PosedBody& implicit, Batch& batch) {
    const Eigen::Vector3f half = implicit.kind->basis.half_extents.cast<float>();
    const float enough = kResidual * half.minCoeff();
    Lanes residual[3];
    for (int i = 0; i < 3; ++i) batch.r[i] = batch.x[i];
    for (int step = 0; step < kNewtonSteps; ++step) {
        Lanes xi[3];
        for (int i = 0; i < 3; ++i) {
            const Lanes bare = batch.r[i] / half[i];
            xi[i] = bare > 1.05f ? lanes_of(1.05f) : bare < -1.05f ? lanes_of(-1.05f) : bare;
        }
        PolynomialValue<Lanes> p =
            evaluate_polynomial<Lanes>(implicit.polynomial.data(), xi[0], xi[1], xi[2]);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) p.gradient[i][j] /= half[j];
        const Inverse<Lanes> inverse = inverse_of(p.gradient);
        Lanes worst = lanes_of(0);
        for (int i = 0; i < 3; ++i) {
            residual[i] = batch.r[i] + p.u[i] - batch.x[i];
            const Lanes size = absolute(residual[i]);
            worst = size > worst ? size : worst;
        }
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) batch.inverse[i][j] = inverse.m[i][j];
            const Lanes move =
                inverse.m[i][0] * residual[0] + inverse.m[i][1] * residual[1] + inverse.m[i][2] * residual[2];
            const float longest = 0.5f * half[i];
            const Lanes cut = move > longest    ? lanes_of(longest)
                              : move < -longest ? lanes_of(-longest)
                                                : move;
            batch.r[i] -= cut;
        }
        if (!any(!(worst < enough))) return;
        if (step + 1 < kNewtonSteps) continue;
        for (int lane = 0; lane < kLanes; ++lane) {
            if (worst[lane] < enough) continue;
            fallbacks_ += lane < batch.count;
            for (int i = 0; i < 3; ++i) {
                batch.r[i][lane] = batch.x[i][lane];
                for (int j = 0; j < 3; ++j) batch.inverse[i][j][lane] = i == j ? 1 : 0;
            }
        }
    }
}

void SampleFinder::invert_bricks(const PosedBody& implicit, Batch& batch) {
    const BodyKind& kind = *implicit.kind;
    const Eigen::Vector3f half = kind.basis.half_extents.cast<float>();
    const Eigen::Vector3f scale = static_cast<float>(kind.bricks) * half.cwiseInverse();
    for (int lane = 0; lane < batch.count; ++lane) {
        const Eigen::Vector3f x(batch.x[0][lane], batch.x[1][lane], batch.x[2][lane]);
        Eigen::Vector3f r = x;
        Eigen::Matrix3f inverse = Eigen::Matrix3f::Identity();
        bool done = false;
        for (int step = 0; step < kNewtonSteps && !done; ++step) {
            const BodyKind::Local at = kind.locate(r);
            PolynomialValue<float> p = evaluate_polynomial<float>(implicit.polynomial.data() + 81 * at.brick,
                                                                  at.xi.x(), at.xi.y(), at.xi.z());
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) p.gradient[i][j] *= scale[j];
            const Inverse<float> found = inverse_of(p.gradient);
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) inverse(i, j) = found.m[i][j];
            const Eigen::Vector3f residual = r + Eigen::Vector3f(p.u[0], p.u[1], p.u[2]) - x;
            done = residual.cwiseAbs().maxCoeff() < kResidual * half.minCoeff();
            r -= (inverse * residual).cwiseMax(-0.5f * half).cwiseMin(0.5f * half);
        }
        if (!done) {
            ++fallbacks_;
            r = x;
            inverse.setIdentity();
        }
        for (int i = 0; i < 3; ++i) {
            batch.r[i][lane] = r[i];
            for (int j = 0; j < 3; ++j) batch.inverse[i][j][lane] = inverse(i, j);
        }
    }
}

}  // namespace sim
