#include "contact/implicit_contact.h"

#include <immintrin.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "shape/shape_polynomial.h"

namespace sim {
namespace {

constexpr int kNewtonSteps = 10;
constexpr float kResidual = 1e-4f;    // share of the size
constexpr float kLongestStep = 0.5f;  // of Newton, share of the half extents

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
Lanes within(Lanes a, float limit) {
    const Lanes high = lanes_of(limit), low = lanes_of(-limit);
    return a > high ? high : a < low ? low : a;
}
bool any(LaneMask mask) {
    return bits_of(mask) != 0;
}

// For each set of lanes, these first.
struct Packing {
    alignas(32) std::int32_t order[256][kLanes];
    constexpr Packing() : order{} {
        for (unsigned set = 0; set < 256; ++set)
            for (int lane = 0, to = 0; lane < kLanes; ++lane)
                if (set >> lane & 1) order[set][to++] = lane;
    }
};
constexpr Packing kPacking;

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

// At the centre every direction is as good: out by the way the sampled body is.
void leave_centre(const PosedBody& sampled, const PosedBody& implicit, SampleContact& contact) {
    const Eigen::Vector3d out = implicit.rotation.transpose() * (sampled.position - implicit.position);
    contact.separation = -static_cast<float>(implicit.kind->definition.shape.base.semi_axes.minCoeff());
    contact.normal =
        out.norm() > 1e-9 ? Eigen::Vector3f(out.normalized().cast<float>()) : Eigen::Vector3f::UnitY();
}

}  // namespace

/// Eight points on their way from the deformed frame to the rest shape.
struct SampleFinder::Batch {
    Lanes x[3];           // deformed
    Lanes r[3];           // at rest
    Lanes inverse[3][3];  // F^-1 there
    Lanes value;          // N(r) - 1, or the distance where that is at hand
    Lanes normal[3];      // F^-T of its gradient
    int count;
};

/// How the implicit body's frame sees the sampled one's, and what is near it.
struct SampleFinder::Approach {
    Eigen::Matrix3f turn;
    Eigen::Vector3f shift, box;
    float ball;

    /// A bit for each of eight balls that reach into the box and the ball; x: their centres, there.
    [[nodiscard]] unsigned near(const float* centres, int stride, Lanes radius, Lanes (&x)[3]) const {
        const Lanes a = load_lanes(centres), b = load_lanes(centres + stride),
                    c = load_lanes(centres + 2 * stride), r = radius + ball;
        for (int i = 0; i < 3; ++i) x[i] = turn(i, 0) * a + turn(i, 1) * b + turn(i, 2) * c + shift[i];
        return bits_of((absolute(x[0]) < radius + box[0]) & (absolute(x[1]) < radius + box[1]) &
                       (absolute(x[2]) < radius + box[2]) &
                       (x[0] * x[0] + x[1] * x[1] + x[2] * x[2] < r * r));
    }
};

void SampleFinder::find(const PosedBody& sampled, const PosedBody& implicit, float margin,
                        std::vector<SampleContact>& found) {
    gather(sampled, implicit, margin);
    for (std::size_t first = 0; first < near_count_; first += kLanes) {
        Batch batch;
        batch.count = static_cast<int>(std::min<std::size_t>(kLanes, near_count_ - first));
        for (int i = 0; i < 3; ++i) batch.x[i] = load_lanes(near_place_.data() + i * capacity_ + first);
        invert(implicit, batch);
        measure(*implicit.kind, batch);
        const Lanes steep =
            square_root(batch.normal[0] * batch.normal[0] + batch.normal[1] * batch.normal[1] +
                        batch.normal[2] * batch.normal[2]);
        const Lanes separation = batch.value / steep;
        const LaneMask central = !(steep > 1e-6f);
        unsigned left = bits_of((separation < margin) | central);
        for (left &= (1u << batch.count) - 1; left != 0; left &= left - 1) {
            const int lane = std::countr_zero(left);
            SampleContact& contact = found.emplace_back();
            contact.sample = near_[first + static_cast<std::size_t>(lane)];
            contact.rest = {batch.r[0][lane], batch.r[1][lane], batch.r[2][lane]};
            if (central[lane]) {
                leave_centre(sampled, implicit, contact);
                continue;
            }
            contact.separation = separation[lane];
            contact.normal =
                Eigen::Vector3f(batch.normal[0][lane], batch.normal[1][lane], batch.normal[2][lane]) /
                steep[lane];
        }
    }
}

void SampleFinder::measure(const BodyKind& kind, Batch& batch) {
    Lanes g[3];
    if (kind.ellipsoid) {
        const Eigen::Vector3f scale = kind.definition.shape.base.semi_axes.cwiseInverse().cast<float>();
        Lanes u[3];
        for (int i = 0; i < 3; ++i) u[i] = batch.r[i] * scale[i];
        const Lanes n = square_root(u[0] * u[0] + u[1] * u[1] + u[2] * u[2]);
        batch.value = n - 1;
        const Lanes inverse = 1 / (n < 1e-6f ? lanes_of(1e-6f) : n);
        for (int i = 0; i < 3; ++i) g[i] = u[i] * inverse * scale[i];
    } else {
        batch.value = g[0] = g[1] = g[2] = lanes_of(0);
        for (int lane = 0; lane < batch.count; ++lane) {
            const SurfacePoint s =
                kind.surface.distance(Eigen::Vector3d(batch.r[0][lane], batch.r[1][lane], batch.r[2][lane]));
            batch.value[lane] = static_cast<float>(s.distance);
            for (int i = 0; i < 3; ++i) g[i][lane] = static_cast<float>(s.normal[i]);
        }
    }
    for (int i = 0; i < 3; ++i)
        batch.normal[i] =
            batch.inverse[0][i] * g[0] + batch.inverse[1][i] * g[1] + batch.inverse[2][i] * g[2];
}

void SampleFinder::gather(const PosedBody& sampled, const PosedBody& implicit, float margin) {
    const BodyKind& kind = *sampled.kind;
    const int stride = kind.batches * kLanes, width = whole_lanes(kind.batches);
    if (capacity_ < static_cast<std::size_t>(stride + kLanes)) {
        capacity_ = static_cast<std::size_t>(stride + kLanes);
        near_place_.resize(3 * capacity_);
        near_.resize(capacity_);
    }
    near_count_ = 0;
    const Eigen::Matrix3d into = implicit.rotation.transpose();
    const Approach approach{(into * sampled.rotation).cast<float>(),
                            (into * (sampled.position - implicit.position)).cast<float>(),
                            implicit.half_box.array() + margin, implicit.radius + margin};
    const float *balls = kind.batch_balls.data(), *samples = sampled.sample_data();
    Lanes x[3];
    for (int first = 0; first < width; first += kLanes) {
        const Lanes grown = load_lanes(balls + 3 * width + first) + sampled.sample_reach;
        for (unsigned left = approach.near(balls + first, width, grown, x); left != 0; left &= left - 1) {
            const int at = kLanes * (first + std::countr_zero(left));
            if (at >= stride) break;
            const unsigned near = approach.near(samples + at, stride, lanes_of(0), x);
            if (near != 0) keep(x, at, near & ((1U << std::min(kLanes, kind.samples - at)) - 1));
        }
    }
    for (std::size_t pad = near_count_; pad % kLanes != 0; ++pad)
        for (int i = 0; i < 3; ++i)
            near_place_.data()[i * capacity_ + pad] = near_place_.data()[i * capacity_ + near_count_ - 1];
}

void SampleFinder::keep(const Lanes (&x)[3], int first, unsigned lanes) {
    const LaneMask order = *reinterpret_cast<const LaneMask*>(kPacking.order[lanes]);
    for (int i = 0; i < 3; ++i) {
        const Lanes packed = picked(x[i], order);
        std::memcpy(near_place_.data() + static_cast<std::size_t>(i) * capacity_ + near_count_, &packed,
                    sizeof(packed));
    }
    const LaneMask samples = order + first;
    std::memcpy(near_.data() + near_count_, &samples, sizeof(samples));
    near_count_ += static_cast<std::size_t>(std::popcount(lanes));
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
    const Eigen::Vector3f half = implicit.kind->basis.half_extents.cast<float>(), scale = half.cwiseInverse();
    const float enough = kResidual * half.minCoeff();
    Lanes first[3];  // x - u(x)
    for (int i = 0; i < 3; ++i) batch.r[i] = batch.x[i];
    for (int step = 0; step < kNewtonSteps; ++step) {
        PolynomialValue<Lanes> p = evaluate_polynomial<Lanes>(
            implicit.polynomial.data(), batch.r[0] * scale[0], batch.r[1] * scale[1], batch.r[2] * scale[2]);
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) p.gradient[i][j] *= scale[j];
        const Inverse<Lanes> inverse = inverse_of(p.gradient);
        Lanes residual[3], worst = lanes_of(0);
        for (int i = 0; i < 3; ++i) {
            residual[i] = batch.r[i] + p.u[i] - batch.x[i];
            worst = absolute(residual[i]) > worst ? absolute(residual[i]) : worst;
            if (step == 0) first[i] = batch.x[i] - p.u[i];
        }
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) batch.inverse[i][j] = inverse.m[i][j];
            const Lanes move =
                inverse.m[i][0] * residual[0] + inverse.m[i][1] * residual[1] + inverse.m[i][2] * residual[2];
            batch.r[i] -= within(move, kLongestStep * half[i]);
        }
        if (!any(!(worst < enough))) return;
        if (step + 1 == kNewtonSteps) fall_back(batch, worst < enough, first);
    }
}

void SampleFinder::fall_back(Batch& batch, LaneMask done, const Lanes (&first)[3]) {
    for (int lane = 0; lane < kLanes; ++lane) {
        if (done[lane]) continue;
        fallbacks_ += lane < batch.count;
        for (int i = 0; i < 3; ++i) {
            batch.r[i][lane] = first[i][lane];
            for (int j = 0; j < 3; ++j) batch.inverse[i][j][lane] = i == j ? 1 : 0;
        }
    }
}

void SampleFinder::invert_bricks(const PosedBody& implicit, Batch& batch) {
    const BodyKind& kind = *implicit.kind;
    const Eigen::Vector3f half = kind.basis.half_extents.cast<float>();
    const float bricks = static_cast<float>(kind.bricks);
    Lanes first[3];
    LaneMask done{};
    for (int i = 0; i < 3; ++i) first[i] = batch.r[i] = batch.x[i];
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) batch.inverse[i][j] = lanes_of(i == j ? 1.f : 0.f);
    for (int lane = 0; lane < batch.count; ++lane) {
        const Eigen::Vector3f x(batch.x[0][lane], batch.x[1][lane], batch.x[2][lane]);
        Eigen::Vector3f r = x;
        Eigen::Matrix3f inverse;
        for (int step = 0; step < kNewtonSteps && !done[lane]; ++step) {
            const BodyKind::Local at = kind.locate(r);
            // Outside the box the border's brick goes on.
            const Eigen::Vector3f xi =
                at.xi + bricks * (r - r.cwiseMax(-half).cwiseMin(half)).cwiseQuotient(half);
            PolynomialValue<float> p = evaluate_polynomial<float>(implicit.polynomial.data() + 81 * at.brick,
                                                                  xi.x(), xi.y(), xi.z());
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) p.gradient[i][j] *= bricks / half[j];
            const Inverse<float> found = inverse_of(p.gradient);
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j) inverse(i, j) = found.m[i][j];
            const Eigen::Vector3f u(p.u[0], p.u[1], p.u[2]), residual = r + u - x;
            for (int i = 0; step == 0 && i < 3; ++i) first[i][lane] = x[i] - u[i];
            done[lane] = residual.cwiseAbs().maxCoeff() < kResidual * half.minCoeff() ? -1 : 0;
            r -= (inverse * residual).cwiseMax(-kLongestStep * half).cwiseMin(kLongestStep * half);
        }
        for (int i = 0; i < 3; ++i) {
            batch.r[i][lane] = r[i];
            for (int j = 0; j < 3; ++j) batch.inverse[i][j][lane] = inverse(i, j);
        }
    }
    for (int lane = batch.count; lane < kLanes; ++lane) done[lane] = -1;
    fall_back(batch, done, first);
}

}  // namespace sim
