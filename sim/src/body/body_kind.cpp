#include "body/body_kind.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "shape/shape_polynomial.h"

namespace sim {
namespace {

// Orders points so that each eight in a row lie together: halves (of whole eights) along the longest axis of
// their box, and so on.
void gather_neighbours(Eigen::Vector3d* points, std::ptrdiff_t count) {
    if (count <= kLanes) return;
    Eigen::AlignedBox3d box;
    for (std::ptrdiff_t i = 0; i < count; ++i) box.extend(points[i]);
    int axis = 0;
    box.sizes().maxCoeff(&axis);
    const std::ptrdiff_t half = (count / 2 + kLanes - 1) / kLanes * kLanes;
    std::sort(points, points + count, [axis](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
        for (const int i : {axis, (axis + 1) % 3, (axis + 2) % 3})
            if (a[i] != b[i]) return a[i] < b[i];
        return false;
    });
    gather_neighbours(points, half);
    gather_neighbours(points + half, count - half);
}

void set_batch_balls(BodyKind& kind) {
    const int padded = kind.batches * kLanes, width = whole_lanes(kind.batches);
    kind.batch_balls.resize(4 * width);
    for (int batch = 0; batch < width; ++batch) {
        Eigen::Matrix<float, 3, kLanes> points;
        const int first = std::min(batch, kind.batches - 1) * kLanes;
        for (int i = 0; i < 3; ++i)
            for (int lane = 0; lane < kLanes; ++lane)
                points(i, lane) = kind.rest.data()[i * padded + first + lane];
        const Eigen::Vector3f centre = points.rowwise().mean();
        for (int i = 0; i < 3; ++i) kind.batch_balls.data()[i * width + batch] = centre[i];
        kind.batch_balls.data()[3 * width + batch] =
            1.0001f * (points.colwise() - centre).colwise().norm().maxCoeff();
        kind.sample_box =
            kind.sample_box.cwiseMax(points.rowwise().maxCoeff()).cwiseMax(-points.rowwise().minCoeff());
        kind.sample_radius = std::max(kind.sample_radius, points.colwise().norm().maxCoeff());
    }
}

void set_samples(BodyKind& kind) {
    SurfaceMesh mesh = surface_mesh(kind.definition.shape, kind.definition.triangles);
    gather_neighbours(mesh.vertices.data(), static_cast<std::ptrdiff_t>(mesh.vertices.size()));
    kind.samples = static_cast<int>(mesh.vertices.size());
    kind.batches = whole_lanes(kind.samples) / kLanes;
    const int padded = kind.batches * kLanes;
    kind.rest.resize(3 * padded);
    kind.shapes.resize(static_cast<std::size_t>(kind.modes) * 3 * padded);
    kind.sample_shapes.resize(static_cast<std::size_t>(padded) * 3 * kind.mode_width);
    kind.half_box = kind.definition.shape.base.semi_axes;
    kind.shape_bound = Eigen::VectorXd::Zero(kind.modes);
    for (int s = 0; s < padded; ++s) {
        const Eigen::Vector3d& r = mesh.vertices[std::min(s, kind.samples - 1)];
        kind.half_box = kind.half_box.cwiseMax(r.cwiseAbs());
        const Eigen::Matrix3Xd phi = mode_shapes_at(kind.basis, r);
        kind.shape_bound = kind.shape_bound.cwiseMax(phi.colwise().norm().transpose());
        for (int axis = 0; axis < 3; ++axis) {
            kind.rest.data()[axis * padded + s] = static_cast<float>(r[axis]);
            for (int k = 0; k < kind.modes; ++k) {
                const float value = static_cast<float>(phi(axis, k));
                kind.shapes.data()[(k * 3 + axis) * padded + s] = value;
                kind.sample_shapes.data()[(s * 3 + axis) * kind.mode_width + k] = value;
            }
        }
    }
    set_batch_balls(kind);
}

void set_polynomials(BodyKind& kind) {
    const int k = kind.basis.elements, m = 2 * k + 1;
    kind.bricks = k;
    kind.polynomials.resize(static_cast<std::size_t>(k * k * k) * 81 * kind.mode_width);
    const int rows = whole_lanes(k * k * k * 81);
    kind.mode_polynomials.resize(static_cast<std::size_t>(rows) * static_cast<std::size_t>(kind.modes));
    for (int brick = 0; brick < k * k * k; ++brick) {
        const int bx = brick % k, by = brick / k % k, bz = brick / (k * k);
        for (int mode = 0; mode < kind.modes; ++mode) {
            Eigen::Matrix<double, 27, 3> nodes;
            for (int n = 0; n < 27; ++n) {
                const int node = 2 * bx + n % 3 + m * (2 * by + n / 3 % 3 + m * (2 * bz + n / 9));
                nodes.row(n) = kind.basis.nodal.block<3, 1>(3 * node, mode).transpose();
            }
            const Eigen::Matrix<double, 27, 3> c = polynomial_from_nodes(nodes);
            float* out =
                kind.polynomials.data() + static_cast<std::size_t>(brick) * 81 * kind.mode_width + mode;
            for (int n = 0; n < 27; ++n)
                for (int axis = 0; axis < 3; ++axis) {
                    out[(3 * n + axis) * kind.mode_width] = static_cast<float>(c(n, axis));
                    kind.mode_polynomials
                        .data()[static_cast<std::ptrdiff_t>(mode) * rows + brick * 81 + 3 * n + axis] =
                        static_cast<float>(c(n, axis));
                }
        }
    }
}

std::vector<Eigen::Vector3d> probes_of(const BodyKind& kind) {
    std::vector<Eigen::Vector3d> probes = {Eigen::Vector3d::Zero()};
    for (int n = 0; n < 27; ++n) {
        if (n == 13) continue;
        const Eigen::Vector3d way(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
        const Eigen::Vector3d top =
            kind.surface.base().onto_surface(way.cwiseProduct(kind.definition.shape.base.semi_axes));
        probes.push_back(top), probes.push_back(top / 2);
    }
    probes.resize(kProbes, probes.front());
    return probes;
}

void set_gradients(BodyKind& kind) {
    const std::vector<Eigen::Vector3d> probes = probes_of(kind);
    kind.gradients.resize(static_cast<std::size_t>(kind.modes) * 9 * kProbes);
    kind.gradient_bound = Eigen::VectorXd::Zero(kind.modes);
    for (int mode = 0; mode < kind.modes; ++mode) {
        const Eigen::VectorXd nodal = kind.basis.nodal.col(mode);
        for (std::size_t p = 0; p < kProbes; ++p) {
            const Eigen::Matrix3d g = displacement_at(kind.basis, nodal, probes[p]).gradient;
            kind.gradient_bound[mode] = std::max(kind.gradient_bound[mode], g.norm());
            for (int e = 0; e < 9; ++e)
                kind.gradients
                    .data()[(static_cast<std::size_t>(mode) * 9 + static_cast<std::size_t>(e)) * kProbes +
                            p] = static_cast<float>(g(e / 3, e % 3));
        }
    }
}

ModalBasis basis_of(const WorldBody& body, FidelityChoice& choice) {
    if (choice.fidelity == Fidelity::linear) return uniform_strain_basis(body.shape.base, body.material);
    ModalBasis none;
    none.half_extents = body.shape.base.semi_axes;
    if (choice.fidelity == Fidelity::rigid) return none;
    ModesRequest request;
    request.shape = body.shape.base;
    request.domain = body.fidelity.domain;
    request.material = body.material;
    request.elements = body.fidelity.elements;
    request.count = choice.modes;
    FreeVibrationModes modes = free_vibration_modes(request);
    choice.cut = modes.cut;
    return std::move(modes.basis);
}

FidelityChoice choice_of(const WorldBody& body) {
    if (!body.moves()) return {Fidelity::rigid, 0, 0};
    if (body.fidelity.fidelity == Fidelity::automatic)
        return choose_fidelity(body.shape.base, body.material, body.fidelity);
    const int modes = body.fidelity.fidelity == Fidelity::rigid    ? 0
                      : body.fidelity.fidelity == Fidelity::linear ? 6
                                                                   : body.fidelity.modes;
    return {body.fidelity.fidelity, modes, 0};
}

bool same_shape(const GeneralizedSuperquadric& a, const GeneralizedSuperquadric& b) {
    return a.base.semi_axes == b.base.semi_axes && a.base.e1 == b.base.e1 && a.base.e2 == b.base.e2 &&
           a.bumps.size() == b.bumps.size() &&
           std::equal(a.bumps.begin(), a.bumps.end(), b.bumps.begin(), [](const Bump& p, const Bump& q) {
               return p.direction == q.direction && p.height_m == q.height_m && p.width_rad == q.width_rad;
           });
}

}  // namespace

HeldStep held_step(double omega, double sigma, double tau) noexcept {
    const OscillatorStep s = oscillator_step(omega, sigma, tau);
    const double turn = omega * tau, fade = sigma * tau;
    // 1 - a cancels for slow modes; there it is turn^2 / 2 (1 - 2 fade / 3) to 1e-8.
    const bool slow = turn < 1e-4 && fade < 1e-4;
    const double exact = slow ? (1 - 2 * fade / 3) / 2 : (1 - s.a) / (turn * turn);
    const double compliance = std::max(exact, 1e-20), rate = s.b / tau;
    return {(s.a - 1) / tau, rate, compliance, s.c, s.d, rate, std::sqrt(compliance)};
}

HeldSteps::HeldSteps(const Eigen::VectorXd& omega, const Eigen::VectorXd& sigma, double tau) {
    const Eigen::Index n = omega.size();
    for (Eigen::ArrayXd* values : {&mean_z, &mean_rate, &compliance, &c, &d, &rate, &root_compliance})
        values->resize(n);
    for (Eigen::Index k = 0; k < n; ++k) {
        const HeldStep step = held_step(omega[k], sigma[k], tau);
        mean_z[k] = step.mean_z, mean_rate[k] = step.mean_rate, compliance[k] = step.compliance;
        c[k] = step.c, d[k] = step.d, rate[k] = step.rate, root_compliance[k] = step.root_compliance;
    }
}

BodyKind make_body_kind(const WorldBody& body, const WorldSettings& settings) {
    FidelityChoice choice = choice_of(body);
    BodyKind kind{body,
                  choice,
                  GeneralizedSurface(body.shape),
                  rigid_mass(body.shape.base, body.material),
                  basis_of(body, choice),
                  {},
                  {},
                  {},
                  Eigen::Vector3d::Zero()};
    kind.modes = kind.basis.count();
    kind.choice.modes = kind.modes;
    kind.choice.cut = choice.cut;
    kind.root_mass = std::sqrt(kind.mass.mass);
    kind.root_inertia = kind.mass.inertia.cwiseSqrt();
    kind.step_drag = std::exp(-body.damping_alpha * settings.dt);
    kind.mode_width = whole_lanes(kind.modes);
    kind.width = 8 + kind.mode_width;
    kind.ellipsoid = body.shape.base.e1 == 1 && body.shape.base.e2 == 1 && body.shape.bumps.empty();
    kind.sigma =
        body.damping_alpha / 2 +
        kind.basis.omega.array() * (body.damping_ratio + body.damping_beta / 2 * kind.basis.omega.array());
    kind.whole = HeldSteps(kind.basis.omega, kind.sigma, settings.dt);
    double tau = settings.dt / settings.substeps;
    for (BodyKind::Substep& substep : kind.substeps) {
        substep.held = HeldSteps(kind.basis.omega, kind.sigma, tau);
        substep.drag = std::exp(-body.damping_alpha * tau);
        substep.root_compliance.resize(static_cast<std::size_t>(kind.mode_width));
        for (int k = 0; k < kind.modes; ++k)
            substep.root_compliance.data()[k] = static_cast<float>(substep.held.root_compliance[k]);
        tau /= 2;
    }
    set_samples(kind);
    if (kind.modes > 0) {
        set_polynomials(kind);
        set_gradients(kind);
    }
    return kind;
}

bool same_kind(const WorldBody& a, const WorldBody& b) noexcept {
    const Material &m = a.material, &n = b.material;
    const FidelityRequest &f = a.fidelity, &g = b.fidelity;
    return a.moves() == b.moves() && same_shape(a.shape, b.shape) && m.young_pa == n.young_pa &&
           m.poisson == n.poisson && m.density_kg_m3 == n.density_kg_m3 &&
           a.damping_alpha == b.damping_alpha && a.damping_beta == b.damping_beta &&
           a.damping_ratio == b.damping_ratio && f.fidelity == g.fidelity && f.modes == g.modes &&
           f.elements == g.elements && f.domain == g.domain && f.error == g.error &&
           f.impact_mps == g.impact_mps && a.triangles == b.triangles;
}

BodyKind::Local BodyKind::locate(const Eigen::Vector3f& r) const noexcept {
    Eigen::Vector3f xi = r.cwiseQuotient(basis.half_extents.cast<float>()).cwiseMax(-1.f).cwiseMin(1.f);
    if (bricks == 1) return {0, xi};
    int index[3];
    for (int axis = 0; axis < 3; ++axis) {
        const float place = 0.5f * (xi[axis] + 1) * static_cast<float>(bricks);
        index[axis] = std::clamp(static_cast<int>(place), 0, bricks - 1);
        xi[axis] = 2 * (place - static_cast<float>(index[axis])) - 1;
    }
    return {index[0] + bricks * (index[1] + bricks * index[2]), xi};
}

void BodyKind::shapes_at(const Eigen::Vector3f& r, float* out) const noexcept {
    const Local local = locate(r);
    float m[27];
    monomials(local.xi.x(), local.xi.y(), local.xi.z(), m);
    const float* row = polynomials.data() + static_cast<std::size_t>(local.brick) * 81 * mode_width;
    for (int at = 0; at < 3 * mode_width; at += kLanes) {
        Lanes sum = lanes_of(0);
        for (int n = 0; n < 27; ++n) sum += lanes_of(m[n]) * load_lanes(row + n * 3 * mode_width + at);
        store_lanes(out + at, sum);
    }
}

}  // namespace sim
