#pragma once
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "files/fields.h"
#include "scene/scene.h"

namespace app {

inline constexpr std::size_t kMostBodies = 10000;
inline constexpr double kRigid = 1e12;  ///< stiffness that stands for an infinite one [N/m]

// What a file says

class SceneReader;

/// A material of a scene, with its damping.
struct SceneMaterial {
    sim::Material material;
    double damping_alpha = 0, damping_beta = 0, damping_ratio = 0.05;
};
using SceneMaterials = std::map<std::string, SceneMaterial>;

/// Copies of a body.
struct BodyGrid {
    std::array<int, 3> count{1, 1, 1};
    Eigen::Vector3d step = Eigen::Vector3d::Zero();
    double jitter_m = 0;
    bool turned = false;
    int seed = 1;
};

struct BodyDraft {
    sim::WorldBody body;
    std::optional<std::string> material;
    std::optional<BodyGrid> grid;
    render::Appearance look;
    std::optional<Eigen::Vector3f> color;
};

struct ConstraintDraft {
    sim::PointConstraint constraint;
    std::string body;
    std::optional<std::string> to;
    std::optional<Eigen::Vector3d> point, to_point, place, at, axis;
    std::optional<double> stiffness;
};

/// A force, with how long it acts, or an impulse.
struct PushDraft {
    sim::TimedForce timed;
    std::string body;
    std::optional<Eigen::Vector3d> force, impulse;
    std::optional<double> seconds;
};

struct EventDraft {
    std::optional<double> time_s;
    std::optional<std::uint64_t> step;
    std::vector<std::string> removed;
    std::optional<BodyDraft> added;
    std::optional<PushDraft> push;
    std::optional<sim::Slowing> slowing;
    SceneReader* reader = nullptr;
};

/// Puts what a file says together: bodies and constraints get numbers, events their order. What does not fit together is
/// refused at its place (BadInput).
class SceneReader {
public:
    Scene scene;
    SceneMaterials materials;
    std::optional<double> dt_s;  ///< stands in for the file's

    void take_body(const Fields& at, const BodyDraft& body);
    void take_constraint(const Fields& at, const ConstraintDraft& draft);
    void take_event(const Fields& at, const EventDraft& draft);
    /// The body that an event adds.
    void take_added(const Fields& at, const EventDraft& event, const BodyDraft& body);
    /// After all tables were read. Bodies that come are numbered in the order in which they come.
    void add_events();

private:
    void place_constraint(const ConstraintDraft& draft, sim::PointConstraint& c) const;
    [[nodiscard]] std::uint64_t step_of(const EventDraft& event) const;
    [[nodiscard]] sim::TimedForce timed(const Fields& at, const EventDraft& event) const;
    [[nodiscard]] std::vector<sim::WorldBody> named(const Fields& at, const BodyDraft& draft, double comes_s);
    void add(const BodyDraft& draft, const std::vector<sim::WorldBody>& bodies,
             std::vector<sim::WorldBody>& into);

    struct TimedEvent {
        sim::WorldEvent event;
        std::optional<BodyDraft> added;
        std::vector<sim::WorldBody> bodies;  ///< of `added`
    };
    struct Pushed {
        sim::TimedForce force;
        std::string body;
    };

    std::map<std::string, int> bodies_, constraints_;
    std::vector<TimedEvent> events_;
    std::vector<Pushed> pushed_;
    std::vector<sim::WorldBody> coming_;  ///< bodies of the event that is read
    std::size_t kinds_ = 0;
};

}  // namespace app
