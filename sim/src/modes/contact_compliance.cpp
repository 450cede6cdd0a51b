#include "modes/contact_compliance.h"

#include <algorithm>
#include <cmath>

#include "modes/linear_body.h"
#include "sim/surface_mesh.h"

namespace sim {
namespace {

constexpr double kPatchOfMode = 1.4;  // see the header
constexpr int kFirstModes = 11;       // fewer show only some directions

Eigen::Vector3d octant_direction(int place) {
    constexpr int kCorner[kContactPlaces] = {1, 2, 4, 3, 5, 6, 7};
    Eigen::Vector3d d;
    for (int i = 0; i < 3; ++i) d[i] = kCorner[place] >> i & 1;
    return d.normalized();
}

// Mean radius of curvature as a patch of a fifth of the width sees it, from the surface's drop beside the point.
double radius_of_curvature(const Gauge& gauge, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                           double width) {
    const Eigen::Vector3d across = normal.unitOrthogonal(), along = normal.cross(across);
    double product = 1;
    constexpr int kWays = 4;
    for (int way = 0; way < kWays; ++way) {
        const double angle = M_PI * way / kWays;
        const Eigen::Vector3d to = std::cos(angle) * across + std::sin(angle) * along;
        double drop = 0;
        for (const int side : {-1, 1})
            drop += 0.5 * normal.dot(point - gauge.onto_surface(point + side * 0.2 * width * to));
        product *= std::min(0.02 * width * width / std::max(drop, 1e-300), 1e3 * width);
    }
    return std::pow(product, 1.0 / kWays);
}

}  // namespace

ContactCompliance::ContactCompliance(const Superquadric& shape, const Material& material)
    : gauge_(shape),
      mass_(rigid_mass(shape, material).mass),
      volume_(mass_ / material.density_kg_m3),
      plane_modulus_(material.young_pa / (1 - material.poisson * material.poisson)) {
    const Gauge& gauge = gauge_;
    for (std::size_t p = 0; p < kContactPlaces; ++p) {
        const Eigen::Vector3d way = octant_direction(static_cast<int>(p)).cwiseProduct(shape.semi_axes);
        point_[p] = gauge.onto_surface(way);
        normal_[p] = gauge.slope(point_[p]).gradient.normalized();
        const Eigen::Vector3d across = normal_[p].unitOrthogonal(), along = normal_[p].cross(across);
        widest_[p] =
            std::sqrt(4 / M_PI * gauge.support(across).dot(across) * gauge.support(along).dot(along));
        radius_[p] = radius_of_curvature(gauge, point_[p], normal_[p], widest_[p]);
    }
    const auto sums = [&](const ModalBasis& basis) {
        Cumulative c = Cumulative::Zero(basis.count() + 1, kContactPlaces);
        for (std::size_t p = 0; p < kContactPlaces; ++p) {
            const Eigen::RowVectorXd along = normal_[p].transpose() * mode_shapes_at(basis, point_[p]);
            for (int k = 0; k < basis.count(); ++k)
                c(k + 1, Eigen::Index(p)) =
                    c(k, Eigen::Index(p)) + along[k] * along[k] / (basis.omega[k] * basis.omega[k]);
        }
        return c;
    };
    linear_ = sums(uniform_strain_basis(shape, material));
    for (int e = 1; e <= kFinestElements; ++e) {
        const int count = e == 1 ? -1 : kMostModes;
        const ModalBasis basis =
            free_vibration_modes({shape, ModeDomain::superquadric, material, e, count}).basis;
        by_elements_[std::size_t(e - 1)] = sums(basis);
        omega_[std::size_t(e - 1)] = basis.omega;
    }
}

int ContactCompliance::place_of(const Eigen::Vector3d& direction) const noexcept {
    const Eigen::Vector3d d = direction.cwiseAbs();
    int best = 0;
    for (int p = 1; p < kContactPlaces; ++p)
        if (d.dot(normal_[std::size_t(p)]) > d.dot(normal_[std::size_t(best)]) * (1 + 1e-12)) best = p;
    return best;
}

int ContactCompliance::place_at(const Eigen::Vector3d& point) const noexcept {
    return place_of(gauge_.slope(point).gradient);
}

double ContactCompliance::radius_at(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d top = gauge_.onto_surface(point);
    const Eigen::Vector3d normal = gauge_.slope(top).gradient.normalized();
    return radius_of_curvature(gauge_, top, normal, widest_[static_cast<std::size_t>(place_of(normal))]);
}

double ContactCompliance::sagitta(int place, const SurfaceMesh& mesh) const {
    constexpr int kWays = 8, kTilts = 3;
    constexpr double kTilt = 0.17;  // [rad], 10 degrees
    const Eigen::Vector3d& n = normal_[static_cast<std::size_t>(place)];
    const Eigen::Vector3d across = n.unitOrthogonal(), along = n.cross(across);
    double deepest = 0;
    for (int i = 0; i < kWays * kTilts; ++i) {
        const double angle = 2 * M_PI * (i + 0.5) / kWays, tilt = kTilt * (1 + i / kWays);
        const Eigen::Vector3d to =
            std::cos(tilt) * n + std::sin(tilt) * (std::cos(angle) * across + std::sin(angle) * along);
        double furthest = 0;
        for (const Eigen::Vector3d& vertex : mesh.vertices) furthest = std::max(furthest, vertex.dot(to));
        deepest = std::max(deepest, gauge_.support(to).dot(to) - furthest);
    }
    return deepest;
}

double ContactCompliance::of_patch(int place, double radius) const {
    const Cumulative& c = by_elements_.back();
    const double wanted = volume_ * std::pow(kPatchOfMode / radius, 3);
    if (wanted >= kMostModes)
        return c(kMostModes, place) +
               3 / (4 * plane_modulus_) * (1 / radius - std::cbrt(kMostModes / volume_) / kPatchOfMode);
    const double n = std::max<double>(wanted, kFirstModes);
    const int below = static_cast<int>(n);
    const double share = n - below;
    return (1 - share) * c(below, place) + share * c(below + 1, place);
}

double ContactCompliance::of_modes(int place, Fidelity fidelity, int modes, int elements) const {
    if (fidelity == Fidelity::rigid) return 0;
    if (fidelity == Fidelity::linear) return linear_(linear_.rows() - 1, place);
    const Cumulative& c = by_elements_[std::size_t(std::min(elements, kFinestElements) - 1)];
    return c(std::min<Eigen::Index>(modes, c.rows() - 1), place);
}

ContactCompliance::Patch ContactCompliance::patch(int place, double force, double radius) const {
    const auto p = std::size_t(place);
    const double curved = radius > 0 ? radius : radius_[p];
    const double hertz = std::cbrt(3 * force * curved / (4 * plane_modulus_));
    return {std::clamp(hertz, 1e-6 * widest_[p], widest_[p]), hertz < widest_[p]};
}

double ContactCompliance::yielding(int place, const Patch& patch) const {
    return of_patch(place, patch.radius) * (patch.grows ? 1.25 : 1);
}

ContactCompliance::Patch ContactCompliance::impact_patch(int place, const ContactLoad& load) const {
    Patch now{0.3 * widest_[std::size_t(place)], true};
    for (int i = 0; i < 30; ++i)  // contracts by 1/3 at least
        now = patch(place, load.speed * std::sqrt(mass_ / yielding(place, now)), load.radius);
    return now;
}

double ContactCompliance::contact_time(int place, const ContactLoad& load) const {
    return M_PI * std::sqrt(mass_ * yielding(place, impact_patch(place, load)));
}

double ContactCompliance::rebound(int place, const ContactLoad& load,
                                  const std::function<double(double)>& sigma) const {
    const double omega_c = M_PI / contact_time(place, load);
    const double whole = of_patch(place, impact_patch(place, load).radius);
    const Cumulative& c = by_elements_.back();
    const Eigen::VectorXd& omega = omega_.back();
    double taken = 0, sum = 0;
    for (Eigen::Index k = 0; k < omega.size() && sum < whole; ++k) {
        const bool last = k + 1 == omega.size();  // stands for all that are faster
        const double part = last ? whole - sum : std::min(c(k + 1, place) - c(k, place), whole - sum);
        taken += part * sigma(omega[k]) / omega[k] * std::min(1.0, omega_c / omega[k]);
        sum += part;
    }
    return std::exp(-M_PI * taken / whole);
}

double ContactCompliance::displacement(int place, const ContactLoad& load) const {
    const double impact =
        load.speed > 0 ? load.speed * std::sqrt(mass_ * yielding(place, impact_patch(place, load))) : 0;
    return std::max(impact, load.force * of_patch(place, patch(place, load.force).radius));
}

ComplianceErrors ContactCompliance::errors(int place, const ContactLoad& load, Fidelity fidelity, int modes,
                                           int elements) const {
    const double used = of_modes(place, fidelity, modes, elements);
    double converged = used;  // the same modes of a mesh without error
    if (fidelity == Fidelity::modal && elements < kFinestElements) {
        const double ratio = static_cast<double>(elements) / kFinestElements;
        const double fine = of_modes(place, fidelity, modes, kFinestElements);
        converged = std::max(used + (fine - used) / (1 - std::pow(ratio, 4)), 0.5 * fine);
    }
    // A round body's samples share a patch that is wider than the modes' waves: these then yield no more than it.
    const auto missed = [](double truth, double have, const Patch& patch) {
        return patch.grows ? std::max(truth - have, 0.0) : std::abs(truth - have);
    };
    ComplianceErrors most;
    if (load.speed > 0) {
        const Patch at = impact_patch(place, load);
        const double factor = at.grows ? 1.25 : 1;
        const double scale = M_PI * load.speed * std::sqrt(mass_ * factor);
        most = {scale * std::abs(std::sqrt(converged) - std::sqrt(used)),
                scale * missed(std::sqrt(of_patch(place, at.radius)), std::sqrt(converged), at)};
    }
    if (load.force > 0) {
        const Patch at = patch(place, load.force);
        const ComplianceErrors held = {2 * load.force * std::abs(converged - used),
                                       2 * load.force * missed(of_patch(place, at.radius), converged, at)};
        if (held.mesh + held.truncation > most.mesh + most.truncation) most = held;
    }
    return most;
}

int ContactCompliance::whole_groups(int modes, int elements) const {
    const Eigen::VectorXd& omega = omega_[std::size_t(elements - 1)];
    int n = std::min<int>(modes, static_cast<int>(omega.size()));
    if (n == omega.size()) return n;
    while (n > 1 && omega[n] <= omega[n - 1] * (1 + 1e-9)) --n;
    return n;
}

}  // namespace sim
