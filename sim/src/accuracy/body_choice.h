#pragma once
#include <vector>

#include "accuracy/load_watch.h"
#include "sim/accuracy.h"

namespace sim {

/// Estimates the errors of one shape and material, and chooses how to compute it.
class BodyEstimates {
public:
    explicit BodyEstimates(const WorldBody& body);
    [[nodiscard]] const ContactCompliance& compliance() const noexcept { return compliance_; }
    /// Of the place that errs most, without the step's.
    [[nodiscard]] BodyError of(const WorldBody& body, const BodyLoads& loads) const;
    /// Sets fidelity, modes, elements and triangles of an automatic body to the cheapest whose error is at most
    /// `allowed`, or else near the least (1.3 times). A body whose impacts last less than `resolved_s` is rigid,
    /// as no step resolves its modes; a rigid one rebounds as the continuum does.
    void choose(WorldBody& body, const BodyLoads& loads, double allowed, double resolved_s) const;
    /// How long its shortest impact lasts [s]; of slow ones, which leave no rebound: for ever.
    [[nodiscard]] double shortest_impact(const BodyLoads& loads) const;
    [[nodiscard]] bool serves(const WorldBody& body) const noexcept;  ///< same shape and material

private:
    [[nodiscard]] double sagitta(int place, int triangles) const;
    [[nodiscard]] double rebound(const WorldBody& body, const BodyLoads& loads) const;

    Superquadric shape_;
    Material material_;
    ContactCompliance compliance_;
    double extent_, thinnest_;  // [m]
    bool ellipsoid_;
    std::vector<std::array<double, kContactPlaces>> sagitta_;  // by kTriangles
};

constexpr double kSlowImpact = 0.1;  ///< [m/s], IslandSolver: slower approaches do not rebound

/// Of the error allowed, what a body's mesh, modes and samples may take; the rest is the step's.
constexpr double kShareOfBody = 0.7;

}  // namespace sim
