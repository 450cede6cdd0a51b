#pragma once
#include <Eigen/Core>
#include <array>
#include <functional>
#include <vector>

#include "shape/superquadric.h"
#include "sim/surface_mesh.h"
#include "sim/world.h"

namespace sim {

constexpr int kContactPlaces = 7;  ///< of an octant: three poles, three middles of edges, the corner

/// What presses on one place of a body.
struct ContactLoad {
    double speed = 0;   ///< of an impact, along the normal [m/s]
    double radius = 0;  ///< of the surface's curvature where it hits [m]; 0: as at the place
    double force = 0;   ///< that lasts [N]
};

/// Displacements of a loaded place that a way to compute the body misses [m].
struct ComplianceErrors {
    double mesh = 0, truncation = 0;
};

/// How much a body yields where it is pressed, as its modes and as the continuum have it, at seven places of an
/// octant (the others by symmetry).
///
/// A place's compliance by the lowest N modes is c_N = sum (n . phi_k)^2 / omega_k^2. It has no limit: under a
/// point load the continuum yields without bound. What presses has a patch, though, of Hertz's radius a
/// (Johnson, "Contact Mechanics", 1985, 4.22), and at most of the area of the body's section:
///   a^3 = 3 F R / (4 E*),  E* = E / (1 - nu^2),  R the surface's mean radius of curvature,
/// and N modes of a body of volume V yield as the continuum does under a patch of
///   a_N = 1.4 (V / N)^(1/3)
/// (waves of N modes are that long; the constant makes a ball's impacts Hertz's). Hence the continuum's
///   c(a) = c_N, N = V (1.4 / a)^3;  where that is beyond kMostModes: c_M + 3 / (4 E*) (1 / a - 1 / a_M).
/// Its modes are those of 4 x 4 x 4 elements; the difference of coarser ones' compliance from it is taken for
/// the mesh's error by Richardson's extrapolation (order 4, as eigenvalues).
///
/// An impact at v presses with F = v sqrt(m / c) and displaces by v sqrt(m c) (5/4 of c where the patch grows:
/// the work of F ~ u^(3/2) is 2/5 F u). It ends after pi sqrt(m c), so a compliance that is off by dc displaces
/// paths after it by pi v |sqrt(m c) - sqrt(m (c + dc))|, which is counted. A force that lasts came suddenly: it
/// displaces by 2 F c at first.
class ContactCompliance {
public:
    static constexpr int kMostModes = 120, kFinestElements = 4;

    ContactCompliance(const Superquadric& shape, const Material& material);  ///< costs 0.1 s

    /// The place that a body touches with where its outward normal is `direction` (body frame).
    [[nodiscard]] int place_of(const Eigen::Vector3d& direction) const noexcept;
    /// The same by a point of the body, or within it.
    [[nodiscard]] int place_at(const Eigen::Vector3d& point) const noexcept;
    /// Mean radius of curvature by a point of the surface, or within it [m].
    [[nodiscard]] double radius_at(const Eigen::Vector3d& point) const;
    /// By how much the surface is at most further than the samples in directions within 30 degrees of a place's
    /// normal [m].
    [[nodiscard]] double sagitta(int place, const SurfaceMesh& mesh) const;
    [[nodiscard]] double of_patch(int place, double radius) const;  ///< the continuum's [m/N]
    /// Of a basis: rigid 0, linear, or the lowest `modes` of `elements` a side [m/N].
    [[nodiscard]] double of_modes(int place, Fidelity fidelity, int modes, int elements) const;
    [[nodiscard]] double displacement(int place, const ContactLoad& load) const;  ///< the continuum's [m]
    [[nodiscard]] ComplianceErrors errors(int place, const ContactLoad& load, Fidelity fidelity, int modes,
                                          int elements) const;
    /// How long an impact lasts: pi sqrt(m c) [s].
    [[nodiscard]] double contact_time(int place, const ContactLoad& load) const;
    /// Speed after an impact by the speed before it, where `sigma` gives the decay rate [1/s] of a mode by its
    /// omega: modes that are much faster than the impact follow it and take 2 sigma omega_c / omega_k^2 of what
    /// they store.
    [[nodiscard]] double rebound(int place, const ContactLoad& load,
                                 const std::function<double(double)>& sigma) const;
    /// The largest number of modes up to `modes` that splits no group of equal frequencies.
    [[nodiscard]] int whole_groups(int modes, int elements) const;

private:
    using Cumulative = Eigen::MatrixXd;  // [modes + 1][places]
    struct Patch {
        double radius;  // [m]
        bool grows;     // with the force
    };
    [[nodiscard]] Patch patch(int place, double force, double radius = 0) const;
    [[nodiscard]] Patch impact_patch(int place, const ContactLoad& load) const;
    [[nodiscard]] double yielding(int place, const Patch& patch) const;

    Gauge gauge_;
    double mass_, volume_, plane_modulus_;
    std::array<Eigen::Vector3d, kContactPlaces> point_, normal_;
    std::array<double, kContactPlaces> radius_, widest_;
    std::array<Cumulative, kFinestElements> by_elements_;
    std::array<Eigen::VectorXd, kFinestElements> omega_;
    Cumulative linear_;
};

}  // namespace sim
