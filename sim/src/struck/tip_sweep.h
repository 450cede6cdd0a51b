#pragma once
#include <vector>

#include "sim/hermite_piece.h"
#include "struck/body_motion.h"

namespace sim {

/// Continuous collision of a stick's tip, a sphere on a cubic Hermite path, with one moving, deforming body.
///
/// Works in the frame of world_from_body. s(t) is the signed distance of the tip's centre, less its radius,
/// to the surface as it is at t (closest_point), and |ds/dt| <= V with V = max|v_tip| + |dD/dt|max R +
/// |swing'|max |x - pivot|max over a segment of the path.
///   Outside and armed, t advances by max(s, 1 mm) / V: nothing can be entered before s is used up, and only
///   a dip shallower than 0.5 mm can hide between two evaluations. A change of sign is closed to 1e-9 s or
///   1e-11 m. After a crossing the sweep is disarmed until it finds s >= 3 mm. A segment whose control
///   polygon keeps clear of the body's box, grown by its reach, costs no evaluation.
/// Departure: above 20 m of travel in a segment the 1 mm becomes 1/20000 of it, which bounds the cost of
/// absurd paths.
class TipSweep {
public:
    TipSweep(const BodyModel& model, const BodyMotion& motion) : model_(&model), motion_(&motion) {}

    /// Appends every inward crossing in order of time; returns the clearance at the first node [m]. Allocates
    /// only if `contacts` is full.
    double sweep(const TipPath& path, std::uint32_t body, std::vector<Contact>& contacts) const;

private:
    struct Walk;
    struct Evaluation;

    /// The piece in the frame of world_from_body.
    [[nodiscard]] HermitePiece segment(const PathNode& from, const PathNode& to) const noexcept;
    [[nodiscard]] Evaluation evaluate(const HermitePiece& segment, double t, double radius,
                                      const Eigen::Vector3d* start) const noexcept;
    [[nodiscard]] double box_distance(const Eigen::Vector3d& low, const Eigen::Vector3d& high) const noexcept;
    void march(const HermitePiece& segment, Walk& walk) const;
    [[nodiscard]] Evaluation close_in(const HermitePiece& segment, const Walk& walk,
                                      const Evaluation& outside, const Evaluation& inside) const noexcept;
    [[nodiscard]] Contact contact(const HermitePiece& segment, const Evaluation& at, const TipPath& path,
                                  std::uint32_t body) const;

    const BodyModel* model_;
    const BodyMotion* motion_;
};

}  // namespace sim
