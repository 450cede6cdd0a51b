#include "contact/implicit_contact.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <map>
#include <random>

namespace sim {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

WorldBody body_of(const Superquadric& shape, Fidelity fidelity) {
    WorldBody body;
    body.shape.base = shape;
    body.material = {.young_pa = 1e6, .poisson = 0.3, .density_kg_m3 = 1000};
    body.fidelity.fidelity = fidelity;
    body.fidelity.modes = 12;
    body.triangles = 500;
    return body;
}

struct Randoms {
    std::mt19937 engine{2011};
    double operator()() { return std::uniform_real_distribution<double>(-1, 1)(engine); }
    Vector3d vector() {
        const double x = (*this)(), y = (*this)(), z = (*this)();
        return {x, y, z};
    }
};

/// A body with random modal coordinates, the largest displacement gradient (spectral norm) at its samples and
/// centre being `gradient`.
struct Posed {
    PosedBody body;
    Eigen::VectorXd nodal;

    Posed(const BodyKind& kind, double gradient, Randoms& random) {
        Eigen::VectorXd q(kind.modes);
        for (double& value : q) value = random();
        double most = 0;
        for (int i = -1; i < kind.samples && kind.modes > 0; ++i)
            most = std::max(most, displacement_at(kind.basis, kind.basis.nodal * q,
                                                  i < 0 ? Vector3d::Zero() : rest(kind, i))
                                      .gradient.operatorNorm());
        if (kind.modes > 0) q *= gradient / most;
        nodal = kind.modes > 0 ? Eigen::VectorXd(kind.basis.nodal * q) : Eigen::VectorXd();
        const Vector3d turn = random.vector();
        body.kind = &kind;
        body.set(random.vector(), Eigen::Quaterniond(Eigen::AngleAxisd(3 * turn.norm(), turn.normalized())),
                 q);
    }
    static Vector3d rest(const BodyKind& kind, int i) {
        const int stride = kind.batches * kLanes;
        return Eigen::Vector3f(kind.rest.data()[i], kind.rest.data()[i + stride],
                               kind.rest.data()[i + 2 * stride])
            .cast<double>();
    }
    [[nodiscard]] Vector3d sample_in_world(int i) const {
        Vector3d r = rest(*body.kind, i);
        if (nodal.size() > 0) r += displacement_at(body.kind->basis, nodal, r).value;
        return body.rotation * r + body.position;
    }
};

/// What (2.8) to (2.11) say in double precision, of a world point.
struct Reference {
    bool in_box;  ///< the basis ends at the box
    double separation;
    Vector3d normal, rest;  ///< body frame
};
Reference reference(const Posed& implicit, const Vector3d& world) {
    const BodyKind& kind = *implicit.body.kind;
    const Vector3d x = implicit.body.rotation.transpose() * (world - implicit.body.position);
    InversePoint inverse{x, Matrix3d::Zero(), 0, false};
    if (implicit.nodal.size() > 0) inverse = inverse_displacement(kind.basis, implicit.nodal, x);
    EXPECT_FALSE(inverse.fallback);
    const Vector3d axes = kind.definition.shape.base.semi_axes;
    double value;
    Vector3d gradient;
    if (kind.ellipsoid) {
        const GaugeSlope slope = kind.surface.base().slope(inverse.r);
        value = slope.value - 1, gradient = slope.gradient;
    } else {
        const SurfacePoint point = kind.surface.distance(inverse.r);
        value = point.distance, gradient = point.normal;
    }
    const Vector3d steep = (Matrix3d::Identity() + inverse.gradient).inverse().transpose() * gradient;
    return {(inverse.r.cwiseAbs().array() < axes.array()).all(), value / steep.norm(), steep.normalized(),
            inverse.r};
}

struct Compared {
    int points = 0;
    double separation = 0, normal = 0, rest = 0;  ///< largest differences; lengths in sizes
};

// Samples in the implicit body's box are compared, and those inside the body must be found.
void compare(const Posed& sampled, const Posed& implicit, SampleFinder& finder, Compared& worst) {
    const BodyKind& kind = *implicit.body.kind;
    const double size = kind.definition.shape.base.semi_axes.minCoeff();
    std::vector<SampleContact> found;
    finder.find(sampled.body, implicit.body, static_cast<float>(0.05 * size), found);
    std::map<int, SampleContact> contacts;
    for (const SampleContact& contact : found) EXPECT_TRUE(contacts.emplace(contact.sample, contact).second);
    for (int i = 0; i < sampled.body.kind->samples; ++i) {
        const Reference expected = reference(implicit, sampled.sample_in_world(i));
        const auto at = contacts.find(i);
        if (expected.separation < -1e-5 * size) {
            ASSERT_NE(at, contacts.end()) << "sample " << i << " at " << expected.separation;
        }
        // Deep in a box the distance passes from face to face with small jumps (its foot is estimated).
        const bool deep = !kind.ellipsoid && expected.separation < -0.5 * size;
        if (at == contacts.end() || !expected.in_box || deep) continue;
        ++worst.points;
        const SampleContact& contact = at->second;
        worst.separation =
            std::max(worst.separation, std::abs(contact.separation - expected.separation) / size);
        worst.rest = std::max(worst.rest, (contact.rest.cast<double>() - expected.rest).norm() / size);
        if (expected.rest.norm() > 0.1 * size)  // at the centre the normal has no limit
            worst.normal = std::max(worst.normal, (contact.normal.cast<double>() - expected.normal).norm());
    }
}

Compared compare_at_random_poses(const Superquadric& shape, Fidelity fidelity, double gradient) {
    const BodyKind kind = make_body_kind(body_of(shape, fidelity), WorldSettings{});
    Randoms random;
    SampleFinder finder;
    Compared worst;
    for (int pose = 0; pose < 40; ++pose) {
        Posed a(kind, gradient, random), b(kind, gradient, random);
        const double distance = (1.1 + 0.9 * random()) * kind.surface.bounding_radius();
        a.body.position = b.body.position + distance * random.vector().normalized();
        compare(a, b, finder, worst);
        compare(b, a, finder, worst);
    }
    EXPECT_EQ(finder.fallbacks(), 0U);
    return worst;
}

struct Case {
    const char* name;
    Superquadric shape;
    Fidelity fidelity;
    double gradient;
};
class SampleFinderAccuracy : public testing::TestWithParam<Case> {};

// Single precision: coordinates of 1 to 2 sizes err by 1e-7, a few operations later by 1e-6. Normals turn by
// position error over radius of curvature, which is 0.07 of the size at the edges of exponents 0.1.
TEST_P(SampleFinderAccuracy, IsThatOfDoublePrecisionTo1em5OfTheSizeAndNormalsTo1em4) {
    const Compared worst =
        compare_at_random_poses(GetParam().shape, GetParam().fidelity, GetParam().gradient);
    EXPECT_GT(worst.points, 1000);
    EXPECT_LT(worst.separation, 1e-5);
    EXPECT_LT(worst.rest, 1e-5);
    EXPECT_LT(worst.normal, 1e-4);
}

const Superquadric kSphere{Vector3d(0.5, 0.5, 0.5), 1, 1}, kEllipsoid{Vector3d(0.3, 0.5, 0.7), 1, 1},
    kBox{Vector3d(0.3, 0.4, 0.5), 0.1, 0.1};
INSTANTIATE_TEST_SUITE_P(Shapes, SampleFinderAccuracy,
                         testing::Values(Case{"RigidEllipsoid", kEllipsoid, Fidelity::rigid, 0},
                                         Case{"LinearEllipsoid", kEllipsoid, Fidelity::linear, 0.3},
                                         Case{"ModalSphere", kSphere, Fidelity::modal, 0.3},
                                         Case{"ModalEllipsoid", kEllipsoid, Fidelity::modal, 0.3},
                                         Case{"RigidBox", kBox, Fidelity::rigid, 0},
                                         Case{"LinearBox", kBox, Fidelity::linear, 0.3},
                                         Case{"ModalBox", kBox, Fidelity::modal, 0.3}),
                         [](const testing::TestParamInfo<Case>& which) { return which.param.name; });

TEST(SampleFinder, ASampleAtTheCentreComesOutTheShortWayAndWithoutNaN) {
    for (const Superquadric& shape : {kSphere, kEllipsoid, kBox})
        for (const Fidelity fidelity : {Fidelity::rigid, Fidelity::linear, Fidelity::modal}) {
            const BodyKind kind = make_body_kind(body_of(shape, fidelity), WorldSettings{});
            PosedBody a, b;
            a.kind = b.kind = &kind;
            const Eigen::VectorXd q = Eigen::VectorXd::Zero(kind.modes);
            b.set(Vector3d::Zero(), Eigen::Quaterniond::Identity(), q);
            a.set(-Posed::rest(kind, 0), Eigen::Quaterniond::Identity(), q);
            SampleFinder finder;
            std::vector<SampleContact> found;
            finder.find(a, b, 0.01F, found);
            ASSERT_FALSE(found.empty());
            for (const SampleContact& contact : found) {
                EXPECT_TRUE(contact.normal.allFinite() && contact.rest.allFinite());
                EXPECT_NEAR(contact.normal.norm(), 1, 1e-5);
            }
            EXPECT_EQ(found[0].sample, 0);
            EXPECT_NEAR(found[0].separation, -shape.semi_axes.minCoeff(), 1e-5);
        }
}

}  // namespace
}  // namespace sim
