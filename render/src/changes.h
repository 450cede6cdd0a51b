#pragma once
#include <Eigen/Geometry>
#include <array>
#include <span>
#include <vector>

#include "object_bounds.h"
#include "render/scene.h"
#include "tile_mask.h"

namespace render {

/// Where in the shadow map texels have changed, and between which depths, in the light's z.
struct ShadowChange {
    PixelBox texels;
    float nearest, farthest;
};

/// How the camera and the light see the scene.
struct Views {
    Eigen::Matrix4f clip_from_world, light_from_world;  ///< the light's is parallel: x, y, z in [-1, 1]
    int width, height, shadow_size;                     ///< shadow_size 0: no shadow
    float floor_height;                                 ///< [m]
    float shadow_filter;                                ///< its reach in the map, all counted [texels]
    float shadow_shift;                                 ///< a receiver looks up this far from where it is [m]
    float shadow_beyond;                                ///< or from its bounds, in all directions [texels]
    float shadow_widening;                              ///< of an object whose shadow is widened [texels]
};

/// What of a picture has to be drawn again for the next frame, all of it safely wide:
/// - tiles that an object touches which moves, now or in the frame before: there surfaces are drawn again,
///   and elsewhere put in another light at most;
/// - of the shadow map, boxes around what has moved. What has changed in them is known when they are drawn
///   again: a comparison with a texel has another outcome only at depths between its values now and before.
///   From these:
/// - tiles in which another object may be looked up there: the prism of a block of texels and its depths,
///   where that is seen within the object's bounds;
/// - of the floor, the tiles that look up there.
/// All else is as it was, since a pixel depends on nothing else. Bounds are hulls of few corners.
class Changes {
public:
    Changes(const Views& views, std::vector<ObjectBounds> bounds);

    /// Compares the frame with the one before. It must fit the scene. Then the boxes of shadow() are drawn.
    void update(const FrameState& frame);
    /// What that has changed. Then the rest is known.
    void take(std::span<const ShadowChange> changes);
    /// Whether all is drawn again, whatever the shadow map's changes.
    [[nodiscard]] bool all() const { return all_; }
    /// The next frame is drawn whole.
    void forget() { known_ = false; }
    /// The next picture is drawn whole, from elsewhere; the shadow map stays.
    void look_from(const Eigen::Matrix4f& clip_from_world);

    [[nodiscard]] const TileMask& objects() const { return objects_; }  ///< where surfaces are drawn again
    [[nodiscard]] const TileMask& picture() const { return picture_; }  ///< these, and shadows that change
    /// Where objects may be seen, whatever is drawn again.
    [[nodiscard]] const TileMask& occupied() const { return occupied_; }
    /// Of the shadow map; none meets another.
    [[nodiscard]] const std::vector<PixelBox>& shadow() const { return shadow_; }
    /// Where in the picture an object has to be drawn again; none: nowhere.
    [[nodiscard]] std::vector<PixelBox> boxes(std::size_t object) const;
    /// Where an object lies in the shadow map.
    [[nodiscard]] PixelBox shadow_box(std::size_t object) const;

private:
    using Points = std::vector<Eigen::Vector3f>;
    using Hull = std::vector<Eigen::Vector2f>;
    /// Places p with least <= normal p <= most.
    struct Slab {
        Eigen::Vector3f normal = Eigen::Vector3f::Zero();
        float least = -1, most = 1;
    };
    /// Where an object is seen, by the camera and by the light.
    struct Seen {
        TileMask::Cover cover;
        Points from_light;  ///< corners; none: not visible
        Shadow shadow = Shadow::cast;
        Eigen::AlignedBox3f box;    ///< around them, a little more
        std::array<Slab, 3> slabs;  ///< all between them, likewise: around the box in the object's frame
    };

    [[nodiscard]] Seen see(const FrameState& frame, std::size_t object) const;
    [[nodiscard]] bool moved(const FrameState& frame, std::size_t object) const;
    [[nodiscard]] Hull in_picture(const Points& world) const;
    [[nodiscard]] PixelBox in_shadow_map(const Seen& seen) const;
    [[nodiscard]] std::array<Slab, 3> slabs_around(const Points& corners,
                                                   const Eigen::Matrix4f& light_from_object) const;
    static void cut(Eigen::AlignedBox3f& box, const Slab& slab);
    void add_moved(const Seen& seen);
    void add_receivers(const ShadowChange& change);
    void add_floor(const ShadowChange& change);
    [[nodiscard]] Eigen::AlignedBox2f around(const PixelBox& texels) const;
    void add_to_shadow_map(PixelBox box);

    Views views_;
    Eigen::Matrix4f world_from_light_;
    float pad_;        ///< around a caster, in the light's x and y
    float beyond_;     ///< around a receiver, in the light's x and y
    float depth_pad_;  ///< in the light's z
    std::vector<ObjectBounds> bounds_;
    bool known_ = false, turned_ = false, all_ = false;
    FrameState before_;
    std::vector<Seen> seen_;
    std::vector<bool> moved_;
    TileMask objects_, picture_, occupied_;
    std::vector<PixelBox> shadow_;
};

}  // namespace render
