#pragma once
#include "contact/convex_distance.h"
#include "contact/implicit_contact.h"
#include "contact/manifold.h"

namespace sim {

/// How near each other the surfaces of a pair are looked for.
struct PairSearch {
    float margin;                      ///< largest separation [m]
    const Manifold* before = nullptr;  ///< the pair's manifold in the last step
    bool may_part = false;             ///< bodies may be put inside each other at any time
    bool nearest = false;              ///< with the nearest points of the pair, whatever the samples say
};

/// How near a plane a body's surface is looked for.
struct PlaneSearch {
    float margin;                      ///< largest separation [m]
    const Manifold* before = nullptr;  ///< the pair's manifold in the last step
    bool may_part = false;             ///< the body may be put into the plane at any time
    /// The body's motion over the step: places that it brings to the plane are chosen among those that touch.
    Eigen::Vector3d moved = Eigen::Vector3d::Zero();   ///< its centre [m]
    Eigen::Vector3d turned = Eigen::Vector3d::Zero();  ///< about it [rad]
};

/// Contact points of one pair of bodies, or of a body and a plane, as they are posed.
///
/// Where one of a pair is round (convex_body.h: is_round) it touches with its nearest point, a single one,
/// and rolls as round as it is; likewise on a plane. Other pairs have samples of either in the other's
/// implicit surface, the distances of those outside made exact (closest_point.h: to first order a sample
/// beside a thin body seems to touch it), and where no sample is inside also the nearest points of the pair:
/// edges on edges. Where smooth bodies overlap and their samples do not tell how (they are deep, contradict each other,
/// or only edges cross), all is measured along one axis: that between the nearest points of the bodies made smaller, as little
/// as parts them and up to nine tenths of the smaller half extent, as margins of contact solvers are used (van den Bergen 2001, "Proximity queries
/// and penetration depth computation on 3D game objects"). Allocates only while its buffers grow.
class NarrowPhase {
public:
    void pair(const PosedBody& a, const PosedBody& b, const PairSearch& search, Manifold& manifold);
    /// height: of the centre over the plane [m].
    void plane(const PosedBody& a, const Eigen::Vector3d& normal, float height, const PlaneSearch& search,
               Manifold& manifold);
    [[nodiscard]] std::uint64_t fallbacks() const noexcept { return finder_.fallbacks(); }

private:
    [[nodiscard]] bool nearest(const PosedBody& a, const PosedBody& b, float margin);
    float find_samples(const PosedBody& a, const PosedBody& b, float margin);
    [[nodiscard]] bool agree(float size) const;
    [[nodiscard]] Eigen::Vector3f normal_of(std::size_t found) const;
    bool measure_along_axis(const PosedBody& a, const PosedBody& b);
    void add_samples(const PosedBody& a, const PosedBody& b, float out);
    [[nodiscard]] ContactCandidate candidate_of(const PosedBody& a, const PosedBody& b,
                                                std::size_t found) const;
    void choose(float tolerance, const Manifold* before);
    bool measure_chosen(const PosedBody& a, const PosedBody& b, float tolerance);
    void fill(float size, const Manifold* before, bool may_part, Manifold& manifold);

    Eigen::Matrix3f turn_a_, turn_b_;  // of the pair
    Eigen::Vector3f between_;          // from b's centre to a's
    SampleFinder finder_;
    std::vector<SampleContact> found_;
    std::size_t of_a_ = 0;  // samples of a among found_, the first
    std::vector<ContactCandidate> candidates_;
    std::vector<int> sources_;  // of candidates: of which of found_, if its distance is not exact yet, or -1
    PointChooser chooser_;
    std::array<int, kManifoldPoints> chosen_{};
    int count_ = 0;  // of chosen_
};

/// Smallest semi-axis [m].
[[nodiscard]] double smallest_half(const PosedBody& body) noexcept;

/// Of the smaller half extent: a contact that begins deeper is one of bodies put inside each other. Slow pairs (kSlow) may be
/// found after they met.
constexpr double kDeep = 0.11;
constexpr double kSlop = 0.005;  ///< of the smaller half extent: contacts exist from here on

}  // namespace sim
