#include "accuracy/body_choice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sim {
namespace {

constexpr std::array<int, 4> kTriangles = {180, 360, 1000, 2000};
constexpr double kLinearity = 3;   // of balls of St. Venant-Kirchhoff matter, at 4 to 15 % of their diameter
constexpr double kNearBest = 1.3;  // where nothing suffices
constexpr double kBent = 0.01;     // as is_round: what bends more touches with its samples

SurfaceMesh mesh_of(const Superquadric& shape, int triangles) {
    return surface_mesh(GeneralizedSuperquadric{shape, {}}, triangles);
}

struct Way {
    Fidelity fidelity;
    int modes, elements, triangles;
    double cost;  // multiply-adds of a step, about
};

// Posing a body (PosedBody::set) and searching its samples, by which the modes' cost outgrows all else.
double cost_of(const Way& way) {
    const double samples = 0.5 * way.triangles, modes = way.modes;
    const double bricks = std::pow(way.elements, 3);
    return 1e4 + 30 * samples + modes * (3 * samples + 81 * bricks + 500);
}

}  // namespace

BodyEstimates::BodyEstimates(const WorldBody& body)
    : shape_(body.shape.base),
      material_(body.material),
      compliance_(shape_, material_),
      extent_(2 * shape_.semi_axes.maxCoeff()),
      thinnest_(shape_.semi_axes.minCoeff()),
      ellipsoid_(shape_.e1 == 1 && shape_.e2 == 1 && body.shape.bumps.empty()) {
    for (const int triangles : kTriangles) {
        const SurfaceMesh mesh = mesh_of(shape_, triangles);
        sagitta_.emplace_back();
        for (int p = 0; p < kContactPlaces; ++p)
            sagitta_.back()[std::size_t(p)] = compliance_.sagitta(p, mesh);
    }
}

bool BodyEstimates::serves(const WorldBody& body) const noexcept {
    const Superquadric& s = body.shape.base;
    const Material& m = body.material;
    return s.semi_axes == shape_.semi_axes && s.e1 == shape_.e1 && s.e2 == shape_.e2 &&
           m.young_pa == material_.young_pa && m.poisson == material_.poisson &&
           m.density_kg_m3 == material_.density_kg_m3 &&
           ellipsoid_ == (s.e1 == 1 && s.e2 == 1 && body.shape.bumps.empty());
}

double BodyEstimates::sagitta(int place, int triangles) const {
    for (std::size_t i = 0; i < kTriangles.size(); ++i)
        if (kTriangles[i] == triangles) return sagitta_[i][std::size_t(place)];
    return compliance_.sagitta(place, mesh_of(shape_, triangles));
}

BodyError BodyEstimates::of(const WorldBody& body, const BodyLoads& loads) const {
    const FidelityRequest& f = body.fidelity;
    BodyError most;
    if (!body.moves()) return most;
    for (int p = 0; p < kContactPlaces; ++p) {
        const PlaceLoad& at = loads[std::size_t(p)];
        if (at.load.speed <= 0 && at.load.force <= 0) continue;
        const ComplianceErrors missed = compliance_.errors(p, at.load, f.fidelity, f.modes, f.elements);
        BodyError here;
        here.mesh = missed.mesh / extent_, here.truncation = missed.truncation / extent_;
        here.loaded_s = at.load.speed > 0 ? at.speed_s : at.force_s;
        const double bent = compliance_.displacement(p, at.load);
        if (f.fidelity != Fidelity::rigid) here.linearity = kLinearity * std::pow(bent / extent_, 2);
        const bool round = ellipsoid_ && (f.fidelity != Fidelity::modal || bent <= kBent * thinnest_);
        if (!round) {
            // Samples s apart leave a gap of s^2 / (8 R); a patch of radius a, a^2 = R u, that holds several
            // of them closes all but (s / a)^2 of it.
            const double gap = sagitta(p, body.triangles);
            const double open = f.fidelity == Fidelity::rigid ? 1 : std::min(1.0, 8 * gap / bent);
            here.sampling = gap * open / extent_;
        }
        if (here.total() > most.total()) most = here;
    }
    return most;
}

double BodyEstimates::shortest_impact(const BodyLoads& loads) const {
    double shortest = std::numeric_limits<double>::infinity();
    for (int p = 0; p < kContactPlaces; ++p)
        if (const ContactLoad& load = loads[std::size_t(p)].load; load.speed > kSlowImpact)
            shortest = std::min(shortest, compliance_.contact_time(p, load));
    return shortest;
}

double BodyEstimates::rebound(const WorldBody& body, const BodyLoads& loads) const {
    const auto speed = [](const PlaceLoad& at) { return at.load.speed; };
    const auto hardest = std::ranges::max_element(loads, {}, speed);
    if (speed(*hardest) <= kSlowImpact) return 0;
    return compliance_.rebound(static_cast<int>(hardest - loads.begin()), hardest->load, [&](double omega) {
        return body.damping_alpha / 2 + omega * (body.damping_ratio + body.damping_beta / 2 * omega);
    });
}

void BodyEstimates::choose(WorldBody& body, const BodyLoads& loads, double allowed, double resolved_s) const {
    std::vector<Way> ways;
    const auto add = [&](Fidelity fidelity, int modes, int elements) {
        for (const int triangles : kTriangles) {
            Way way{fidelity, modes, elements, triangles, 0};
            way.cost = cost_of(way);
            ways.push_back(way);
        }
    };
    add(Fidelity::rigid, 0, 1);
    const bool resolved = shortest_impact(loads) >= resolved_s;
    if (resolved) add(Fidelity::linear, 6, 1);
    for (int elements = 1; resolved && elements <= 3; ++elements)
        for (const int modes : {11, 14, 23, 45, 75, 120})
            if (elements > 1 || modes <= 75)
                add(Fidelity::modal, compliance_.whole_groups(modes, elements), elements);
    std::ranges::stable_sort(ways, {}, &Way::cost);
    const auto set = [&](const Way& way) {
        body.fidelity.fidelity = way.fidelity, body.fidelity.modes = std::max(way.modes, 1);
        body.fidelity.elements = way.elements, body.triangles = way.triangles;
    };
    std::vector<double> errors;
    for (const Way& way : ways) set(way), errors.push_back(of(body, loads).total());
    const double enough = std::max(allowed, kNearBest * *std::ranges::min_element(errors));
    const auto first = std::ranges::find_if(errors, [&](double error) { return error <= enough; });
    set(ways[static_cast<std::size_t>(first - errors.begin())]);
    if (body.fidelity.fidelity == Fidelity::rigid)
        body.restitution = std::max(body.restitution, rebound(body, loads));
}

}  // namespace sim
