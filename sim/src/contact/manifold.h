#pragma once
#include <algorithm>
#include <array>

#include "contact/implicit_contact.h"

namespace sim {

/// One point where bodies a and b touch or are about to. World axes; normal from b towards a.
struct ManifoldPoint {
    std::uint32_t feature =
        0;                 ///< sample of a, or sample of b with the top bit set: the same from step to step
    float separation = 0;  ///< negative: overlap [m]
    float begins = -1;     ///< of an impact: its time since the step's start [s]; else -1
    Eigen::Vector3f normal;
    Eigen::Vector3f arm_a, arm_b;      ///< from the centres to the contact, half-way through the overlap [m]
    int sample_a = -1, sample_b = -1;  ///< which of the samples, or -1: see rest
    Eigen::Vector3f rest_a, rest_b;    ///< places in the rest shapes, of a body whose sample is -1
    float gap = 0;                     ///< of an impact, then [m]
    float normal_impulse = 0;          ///< of the last substep, to start the next from [N s]
    Eigen::Vector3f friction_impulse = Eigen::Vector3f::Zero();
};

constexpr int kManifoldPoints = 4;

/// Contact of a pair: at most four points, the deepest and those that span the largest area with it.
struct Manifold {
    int a = 0, b = 0;  ///< bodies, a < b; b >= kFirstPlane: plane b - kFirstPlane
    int count = 0;
    float friction = 0, restitution = 0;
    float impulse_reach = 0;  ///< how far from a point its last impulse may have been, see take_impulses [m]
    bool emerging = false;    ///< came deep into each other, and still overlap
    std::array<ManifoldPoint, kManifoldPoints> points;
    [[nodiscard]] std::uint64_t key() const noexcept {  ///< orders pairs by (a, b)
        return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
    }
};
constexpr int kFirstPlane = 1 << 30;

/// A point that may go into a manifold.
struct ContactCandidate {
    std::uint32_t feature;
    float separation;
    /// Least separation that the motion of the step brings it to, not below 0; of what is inside already, its separation.
    float closest;
    Eigen::Vector3f normal;          ///< from b towards a
    Eigen::Vector3f arm_a;           ///< from a's centre [m]
    Eigen::Vector3f rest_a, rest_b;  ///< places in the rest shapes
};

/// Chooses up to four of a pair's candidates: the deepest (first of equals), the one furthest from it, the
/// one that makes the largest triangle with both, the one that adds most on the other side of an edge; first
/// of those that carry load (that come to tolerance / 16 beyond touching), then, while there are less than four, of
/// those up to `tolerance`. Points that add less than tolerance / 2 of width do not count. Points of
/// `before`, the pair's manifold in the last step (nullptr: none), have an advantage of tolerance / 8 in
/// depth and a fifth in length and area: a flat contact keeps its points. Allocates only while its buffers
/// grow.
class PointChooser {
public:
    /// Their places among the candidates; returns how many.
    int choose(const std::vector<ContactCandidate>& candidates, float tolerance, const Manifold* before,
               std::array<int, kManifoldPoints>& chosen);
    /// No candidate that comes no closer than this can be chosen if one comes to `lowest`.
    [[nodiscard]] static float reach(float lowest, float tolerance) noexcept {
        return std::max(lowest + tolerance / 8, 0.f) + tolerance;
    }

private:
    struct Spot {
        float x, y;  // from the first, across its normal
    };
    void load(const std::vector<ContactCandidate>& candidates, const Manifold* before);
    int deepest(float out, float advantage) const;
    void spread(const std::vector<ContactCandidate>& candidates, int first);
    int next(int count, float out, float apart) const;

    std::size_t count_ = 0;
    LaneArray separation_, closest_, favour_, x_, y_;  // of every candidate, whole lanes
    Spot second_{}, third_{};
};

/// Takes the impulses of last step's manifold of the same pair: by feature, else from the nearest point left
/// within `reach`.
void take_impulses(const Manifold& before, float reach, Manifold& manifold);

}  // namespace sim
