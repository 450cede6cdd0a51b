#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "sim/geometry.h"

namespace sim {

using Vector6d = Eigen::Matrix<double, 6, 1>;

/// Scale and shear of (2.12) as modal coordinates (strains), with their rates; all zero at rest.
///   D = I + [[q0, q5, q4], [q5, q1, q3], [q4, q3, q2]]
///   q0 q1 q2 scale along x, y, z;  q3 q4 q5 shear yz, xz, xy;  dimensionless
/// The state is linear in the impulses, so responses add up exactly. body_matrix and contacts limit it
/// smoothly, each scale to 0.4, each shear to 0.15, the swing to 1 rad (exact up to half of that): the
/// eigenvalues of D stay within 0.3 to 1.7.
struct ModalState {
    Vector6d q = Vector6d::Zero();      ///< [-]
    Vector6d q_dot = Vector6d::Zero();  ///< [1/s]
    double swing = 0;                   ///< hinge angle of a hanging body [rad]
    double swing_dot = 0;               ///< [rad/s]
};

/// How the body is held. Drums are fixed; bells and cymbals hang on a damped hinge of a stated frequency.
struct Stand {
    bool hinged = false;
    Eigen::Vector3d pivot_body = Eigen::Vector3d::Zero();  ///< point of the hinge axis, body frame [m]
    Eigen::Vector3d axis_body = Eigen::Vector3d::UnitX();  ///< unit, body frame
    double frequency_hz = 1.0;
    double damping_ratio = 0.1;
};

/// Solid, homogeneous, isotropic material. SI.
struct Material {
    double young_pa = 1e7;
    double poisson = 0.3;
    double density_kg_m3 = 600;
};

/// The modes that are seen (and touched): softer than what is heard. The six uniform-strain modes keep their
/// shapes and the ratios of their (undamped) frequencies; the lowest becomes `frequency_hz`; amplitudes are
/// scaled so that a reference strike of 5 m/s by the stick's mass along the body's shortest axis displaces
/// the struck point by `displacement` times the largest extent. Of three such strikes, at the pole and near
/// the edge along either other axis, the one that moves its point most is the reference: on a thin body the
/// pole hardly yields.
struct VisualModes {
    bool enabled = true;         ///< false: the body stays rigid
    double frequency_hz = 6;     ///< of the lowest mode, 4-10
    double displacement = 0.03;  ///< share of the size at 5 m/s, 0.02-0.05
    double decay_s = 0.6;        ///< time to fall by 60 dB
};

/// A part of the surface that sounds, in the rest shape's body coordinates.
struct Zone {
    std::string name;       ///< "head", "rim", ...
    double min_radius = 0;  ///< of sqrt((x/a)^2 + (z/c)^2), 0 on the axis
    double max_radius = 1.01;
    double min_height = 0.5;  ///< of y/b: -1 underside, 1 top
    double max_height = 1.5;
};

/// Everything that stays constant about a body that is struck.
struct BodyDefinition {
    std::string name;
    Superquadric shape;
    Material material;
    VisualModes visual;
    Stand stand;
    Eigen::Isometry3d world_from_body = Eigen::Isometry3d::Identity();  ///< at rest
    double stick_mass_kg = 0.05;                                        ///< effective mass of the stick
    double restitution = 0.5;                                           ///< of stick against this body
    std::vector<Zone> zones;  ///< contacts outside every zone are silent and answered with zone -1
};

}  // namespace sim
