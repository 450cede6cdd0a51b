#pragma once
#include <cstdint>
#include <vector>

#include "body/posed_body.h"

namespace sim {

/// A surface sample of one body that is inside another, or near it.
struct SampleContact {
    int sample;
    float separation;        ///< along the normal, negative inside [m]
    Eigen::Vector3f normal;  ///< outward unit normal of the implicit body, in its frame
    Eigen::Vector3f rest;    ///< the sample's place in the implicit body's rest shape (2.11)
};

/// Finds the samples of one body within `margin` of another's implicit surface (2.8-2.11):
///   sample -> implicit body's frame -> box test -> inverse deformation -> gauge -> distance to first order,
///   s = (N(r) - 1) / |F^-T grad N(r)|,  F = I + du/dr,  normal F^-T grad N / |...|.
/// Batches of eight samples are passed over by the balls that hold them; the few samples that pass the box
/// test go on eight at a time. The inverse is closed for rigid and linear bodies; polynomials take Newton
/// steps from r = x (each cut to half the half extents) until the residual is below 1e-4 of the size, and one
/// more (quadratic: about 1e-8; F is that before it). Outside the bricks' box the polynomials are continued.
/// A lane that has not converged after 10 steps takes r = x - u(x), F = I, and is counted. Single precision:
/// separations err by 1e-6 of the size, 1e-5 a size deep (tests compare with double precision).
class SampleFinder {
public:
    /// Appends to `found`, in order of samples. Allocates only while its buffers grow.
    void find(const PosedBody& sampled, const PosedBody& implicit, float margin,
              std::vector<SampleContact>& found);
    [[nodiscard]] std::uint64_t fallbacks() const noexcept { return fallbacks_; }

private:
    struct Batch;
    struct Approach;
    void gather(const PosedBody& sampled, const PosedBody& implicit, float margin);
    void keep(const Lanes (&x)[3], int first, unsigned lanes);
    void invert(const PosedBody& implicit, Batch& batch);
    void invert_polynomial(const PosedBody& implicit, Batch& batch);
    void invert_bricks(const PosedBody& implicit, Batch& batch);
    void fall_back(Batch& batch, LaneMask done, const Lanes (&first)[3]);
    static void measure(const BodyKind& kind, Batch& batch);

    std::vector<int> near_;  // samples
    LaneArray near_place_;   // [axis][capacity]
    std::size_t near_count_ = 0;
    std::size_t capacity_ = 0;
    std::uint64_t fallbacks_ = 0;
};

}  // namespace sim
