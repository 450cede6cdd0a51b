#pragma once
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "files/fields.h"
#include "files/format_description.h"
#include "scene/scene.h"

namespace app {

// Every key of a scene file is declared in scene_keys.cpp. The drafts here hold what a file says.

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
    std::optional<Eigen::Vector3d> point, to_point, place, at;
};

struct EventDraft {
    std::optional<double> time_s;
    std::optional<std::uint64_t> step;
    std::vector<std::string> removed;
    std::optional<BodyDraft> added;
    std::optional<sim::Slowing> slowing;
    std::function<void(const Fields& at, BodyDraft&)> take_added;
};

struct SceneDraft {
    Scene scene;  ///< without bodies, constraints and events
    SceneMaterials materials;
    std::optional<double> dt_s;  ///< stands in for the file's
    std::function<void(const Fields&at, BodyDraft&)> take_body, take_added;
    std::function<void(const Fields& at, ConstraintDraft&)> take_constraint;
    std::function<void(const Fields& at, EventDraft&)> take_event;
};
extern const TableKind<SceneDraft> kSceneFile;

inline constexpr std::size_t kMostBodies = 10000;

/// Keys, ranges and defaults of scene files.
[[nodiscard]] FormatDescription scene_format();

}  // namespace app
