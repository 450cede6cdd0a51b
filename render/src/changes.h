#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "render/scene.h"
#include "tile_mask.h"

namespace render {

/// What an object's vertices lie within, in its own frame: a box, grown by |q_k| times `reach[k]` when mode k
/// has the coordinate q_k.
struct ObjectBounds {
    Eigen::AlignedBox3f box;
    std::vector<Eigen::Vector3f> reach;

    [[nodiscard]] Eigen::AlignedBox3f grown(const FrameState& frame, std::size_t object) const;
};

/// How the camera and the light see the scene.
struct Views {
    Eigen::Matrix4f clip_from_world, light_from_world;  ///< the light's is parallel: x, y, z in [-1, 1]
    int width, height, shadow_size;                     ///< shadow_size 0: no shadow
    float floor_height;                                 ///< [m]
    float shadow_filter;                                ///< its reach in the map, all counted [texels]
    float shadow_shift;                                 ///< a receiver looks up this far from where it is [m]
    float shadow_beyond;                                ///< or from its bounds, in all directions [texels]
};

/// What of a picture has to be drawn again for the next frame, all of it safely wide:
/// - tiles that an object touches which moves, now or in the frame before;
/// - tiles in which an object may lie in that object's shadow, now or before: the part of the shadow's prism
///   at the other object's distances from the light, where that is seen within the other's bounds;
/// - of the floor, the tiles in which the shadow falls;
/// - of the shadow map, boxes around what has moved.
/// All else is as it was, since a pixel depends on nothing else. Bounds are boxes of eight corners.
class Changes {
public:
    Changes(const Views& views, std::vector<ObjectBounds> bounds);

    /// Compares the frame with the one before. It must fit the scene.
    void update(const FrameState& frame);
    /// The next frame is drawn whole.
    void forget() { known_ = false; }

    [[nodiscard]] const TileMask& objects() const { return objects_; }  ///< where objects are drawn again
    [[nodiscard]] const TileMask& picture() const { return picture_; }  ///< these, and the floor's shadow
    /// Of the shadow map; none meets another.
    [[nodiscard]] const std::vector<PixelBox>& shadow() const { return shadow_; }
    /// Where in the picture an object has to be drawn again; none: nowhere.
    [[nodiscard]] std::vector<PixelBox> boxes(std::size_t object) const;
    /// Where an object lies in the shadow map.
    [[nodiscard]] PixelBox shadow_box(std::size_t object) const;

private:
    using Points = std::vector<Eigen::Vector3f>;
    using Hull = std::vector<Eigen::Vector2f>;
    /// Where an object is seen, by the camera [pixels] and by the light.
    struct Seen {
        Hull hull;
        Points from_light;  ///< eight corners; none: not visible
        float nearest = 0, farthest = 0;
    };

    [[nodiscard]] Seen see(const FrameState& frame, std::size_t object) const;
    [[nodiscard]] bool moved(const FrameState& frame, std::size_t object) const;
    [[nodiscard]] Hull in_picture(const Points& world) const;
    [[nodiscard]] PixelBox in_shadow_map(const Seen& seen) const;
    void add_moved(const Seen& seen);
    void add_shadow(const Seen& caster);
    void add_to_shadow_map(PixelBox box);

    Views views_;
    Eigen::Matrix4f world_from_light_;
    float pad_;        ///< around a caster, in the light's x and y
    float depth_pad_;  ///< in the light's z
    std::vector<ObjectBounds> bounds_;
    bool known_ = false;
    FrameState before_;
    std::vector<Seen> seen_;
    std::vector<bool> moved_;
    TileMask objects_, picture_;
    std::vector<PixelBox> shadow_;
};

}  // namespace render
