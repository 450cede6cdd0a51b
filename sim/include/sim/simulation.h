#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/modal_body.h"

namespace sim {

/// Where one state of a stick's filter predicts its tip to go: nodes of a cubic Hermite curve, times strictly
/// increasing, at least two. Swept as a whole against every body; nothing is swept between paths.
struct PathNode {
    double t_s;
    Eigen::Vector3d position;  ///< [m], world
    Eigen::Vector3d velocity;  ///< [m/s], world
};
struct TipPath {
    std::uint32_t stick = 0;
    double tip_radius_m = 0.006;
    std::vector<PathNode> nodes;
};

/// An instantaneous impulse that a stick gives a body.
struct Impulse {
    std::uint32_t body = 0;
    double t_s = 0;
    Eigen::Vector3d point_body = Eigen::Vector3d::Zero();    ///< in the rest shape [m]
    Eigen::Vector3d impulse_body = Eigen::Vector3d::Zero();  ///< [N s], body frame
};

/// A path of a tip enters a body's surface grown by the tip's radius.
struct Contact {
    std::uint32_t stick = 0;
    std::uint32_t body = 0;
    double t_s = 0;  ///< crossing, found to 1e-7 s; the path's first time if the tip starts inside
    bool starts_inside = false;  ///< the tip was inside at the path's first time
    double depth_m = 0;          ///< at the path's first time when it starts inside, else 0
    double speed_mps =
        0;  ///< inward normal speed of the tip relative to the moving, deformed surface (negative: leaving)
    std::int32_t zone = -1;                                 ///< index into the body's zones, -1 silent
    Eigen::Vector3d point_world = Eigen::Vector3d::Zero();  ///< on the deformed surface
    Eigen::Vector3d normal_world = Eigen::Vector3d::UnitY();
    Eigen::Vector3d point_body = Eigen::Vector3d::Zero();  ///< the same material point in the rest shape
    Eigen::Vector3d impulse_body =
        Eigen::Vector3d::Zero();  ///< that the stick's effective mass gives the body [N s], (1 + e) m_eff v
};

/// One impulse as a picture shows it: its response times `weight` is added to the body's state.
struct WeightedImpulse {
    Impulse impulse;
    double weight = 1;
};

/// States of all bodies wanted for a picture at t_s >= the step's time.
struct PictureRequest {
    double t_s = 0;
    std::vector<WeightedImpulse> provisional;  ///< on top of the folded impulses
};

/// One step of the simulation: from the last step's time to t_s.
struct StepRequest {
    double t_s = 0;  ///< not earlier than the last step's
    std::vector<Impulse>
        folded;  ///< impulses that become part of the bodies' exact states; t_s <= this step's time
    std::vector<Impulse> confirmed;  ///< fixed, not yet folded: contacts see them from their time on
    std::vector<TipPath> paths;      ///< each swept as a whole for contacts
    std::vector<PictureRequest> pictures = {};  ///< states wanted for pictures
    bool anew = false;  ///< the bodies are at rest before this step, which may have any time
};

struct StepReply {                   ///< a pure function of the bodies and the requests so far
    std::vector<Contact> contacts;   ///< ordered by stick's place in paths, then time, then body
    std::vector<ModalState> states;  ///< every body's exact state at t_s, in order of definition
    std::vector<std::vector<ModalState>>
        pictures;                     ///< for each request, every body's state in order of definition
    std::vector<double> clearance_m;  ///< paths x bodies, row-major: signed distance of the tip (grown
                                      ///< surface, as deformed) at each path's first node
};

/// What happened to the workers of a run.
struct WorkerReport {
    int count = 0;           ///< asked for
    int lost = 0;            ///< died or fell silent
    int bodies_reowned = 0;  ///< bodies that went on elsewhere
};

/// Steps a fixed set of bodies. The reply is a pure function of the bodies and the requests so far, whichever
/// process computes it. One thread at a time.
class Simulation {
public:
    virtual ~Simulation() = default;
    [[nodiscard]] virtual StepReply step(const StepRequest& request) = 0;  ///< throws std::invalid_argument
    [[nodiscard]] virtual WorkerReport report() const = 0;                 ///< all zero without workers
};

/// Computes in the calling thread. Throws std::invalid_argument for a definition out of range.
[[nodiscard]] std::unique_ptr<Simulation> make_local_simulation(std::vector<BodyDefinition> bodies);

/// How to start a worker process: `program arguments... --connect ENDPOINT`.
struct WorkerLaunch {
    std::string program;                 ///< absolute path
    std::vector<std::string> arguments;  ///< e.g. {"worker"}
    int count = 1;                       ///< processes
    double join_within_s = 20;           ///< one that has not joined by then is given up
};

/// Bodies shared out to worker processes over ZeroMQ (ipc in a private 0700 folder, removed at the end; also
/// after SIGINT/SIGTERM of this process workers end within 2 s). A worker that dies or is silent for 1 s is
/// replaced by the others (by this process when none is left): its bodies go on from their last exact state
/// and the step is repeated. Throws std::runtime_error when a worker cannot be started.
[[nodiscard]] std::unique_ptr<Simulation> make_distributed_simulation(std::vector<BodyDefinition> bodies,
                                                                      const WorkerLaunch& launch);

/// Rest-shape queries for scoring and layout: signed distance of a world point to the body's rest surface
/// grown by `radius_m`.
[[nodiscard]] SurfacePoint rest_distance(const BodyDefinition& body, const Eigen::Vector3d& point_world,
                                         double radius_m);
/// Zone of a world point near the rest surface, -1 if none.
[[nodiscard]] int rest_zone(const BodyDefinition& body, const Eigen::Vector3d& point_world);

/// world_from_body with swing and deformation: the body's one 4x4 matrix (2.9, 2.12).
[[nodiscard]] Eigen::Matrix4d body_matrix(const BodyDefinition& body, const ModalState& state);

}  // namespace sim
