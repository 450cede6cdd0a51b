#include "changes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace render {
namespace {

constexpr float kNearest = 0.02f;       // [m] before the eye, less than the camera's near plane
constexpr std::size_t kMostMoved = 48;  // beyond, all is drawn again: pairs with the others would cost more

Eigen::Vector3f transformed(const Eigen::Matrix4f& matrix, const Eigen::Vector3f& point) {
    return matrix.topLeftCorner<3, 3>() * point + matrix.topRightCorner<3, 1>();
}

}  // namespace

/// Takes off the box's z what no place with its x and y has within the slab; all of it where there is none.
void Changes::cut(Eigen::AlignedBox3f& box, const Slab& slab) {
    constexpr float kSteep = 0.02f;  // less: rounding would count
    const Eigen::Vector2f across = slab.normal.head<2>(), middle = box.center().head<2>();
    const float beside = across.dot(middle), reach = across.cwiseAbs().dot(0.5f * box.sizes().head<2>());
    const float least = slab.least - beside - reach, most = slab.most - beside + reach, z = slab.normal.z();
    if (std::abs(z) < kSteep) return;
    box.min().z() = std::max(box.min().z(), std::min(least / z, most / z));
    box.max().z() = std::min(box.max().z(), std::max(least / z, most / z));
}

Changes::Changes(const Views& views, std::vector<ObjectBounds> bounds)
    : views_(views),
      world_from_light_(views.light_from_world.inverse()),
      bounds_(std::move(bounds)),
      seen_(bounds_.size()),
      moved_(bounds_.size(), true),
      objects_(views.width, views.height),
      picture_(views.width, views.height),
      occupied_(views.width, views.height) {
    const float shift = views.shadow_shift * views.light_from_world.row(0).head<3>().norm();
    const float texel = 2 / static_cast<float>(std::max(views.shadow_size, 1));
    pad_ = shift + texel * (views.shadow_filter + views.shadow_beyond);
    beyond_ = texel * views.shadow_beyond;
    depth_pad_ = views.shadow_shift * views.light_from_world.row(2).head<3>().norm() +
                 texel * views.shadow_beyond + 1e-5f;
}

/// The part before the camera of the hull of points.
Changes::Hull Changes::in_picture(const Points& world) const {
    std::vector<Eigen::Vector4f> clip;
    clip.reserve(world.size());
    for (const Eigen::Vector3f& point : world) clip.push_back(views_.clip_from_world * point.homogeneous());
    Hull seen;
    seen.reserve(clip.size());
    const auto add = [&](const Eigen::Vector4f& p) {
        seen.emplace_back(0.5f * static_cast<float>(views_.width) * (1 + p.x() / p.w()),
                          0.5f * static_cast<float>(views_.height) * (1 + p.y() / p.w()));
    };
    for (const Eigen::Vector4f& a : clip) {
        if (a.w() < kNearest) continue;
        add(a);
        for (const Eigen::Vector4f& b : clip)
            if (b.w() < kNearest) add(a + (b - a) * ((a.w() - kNearest) / (a.w() - b.w())));
    }
    return convex_hull(std::move(seen));
}

Changes::Seen Changes::see(const FrameState& frame, std::size_t object) const {
    Seen seen;
    if (!frame.visible[object]) return seen;
    Points world;
    const Points corners = bounds_[object].corners_now(frame, object);
    for (const Eigen::Vector3f& corner : corners) {
        world.push_back(transformed(frame.world_from_object[object], corner));
        seen.from_light.push_back(transformed(views_.light_from_world, world.back()));
    }
    if (world.empty()) return seen;
    for (const Eigen::Vector3f& corner : seen.from_light) seen.box.extend(corner);
    const Eigen::Vector3f more(beyond_, beyond_, depth_pad_);
    seen.box.min() -= more, seen.box.max() += more;
    seen.slabs = slabs_around(corners, views_.light_from_world * frame.world_from_object[object]);
    seen.cover = picture_.cover(in_picture(world));
    seen.shadow = bounds_[object].shadow;
    return seen;
}

/// A body without a thickness has none that hold anything back.
std::array<Changes::Slab, 3> Changes::slabs_around(const Points& corners,
                                                   const Eigen::Matrix4f& light_from_object) const {
    std::array<Slab, 3> slabs;
    const Eigen::Matrix3d object_from_light =
        light_from_object.topLeftCorner<3, 3>().cast<double>().inverse();
    if (!object_from_light.allFinite()) return slabs;
    Eigen::AlignedBox3f box;
    for (const Eigen::Vector3f& corner : corners) box.extend(corner);
    const Eigen::Vector3d middle = light_from_object.topRightCorner<3, 1>().cast<double>();
    const Eigen::Vector3d more(beyond_, beyond_, depth_pad_);
    for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3d normal = object_from_light.row(i).normalized();
        const double length = object_from_light.row(i).norm(), at = normal.dot(middle);
        const double grown = normal.cwiseAbs().dot(more);
        slabs[static_cast<std::size_t>(i)] = {normal.cast<float>(),
                                              static_cast<float>(at + box.min()[i] / length - grown),
                                              static_cast<float>(at + box.max()[i] / length + grown)};
    }
    return slabs;
}

bool Changes::moved(const FrameState& frame, std::size_t object) const {
    if (frame.visible[object] != before_.visible[object]) return true;
    if (!frame.visible[object]) return false;
    return frame.world_from_object[object] != before_.world_from_object[object] ||
           (!bounds_[object].reach.empty() && frame.modal[object] != before_.modal[object]);
}

void Changes::look_from(const Eigen::Matrix4f& clip_from_world) {
    views_.clip_from_world = clip_from_world;
    turned_ = true;
    if (!known_) return;
    for (std::size_t i = 0; i < seen_.size(); ++i) seen_[i] = see(before_, i);
}

void Changes::update(const FrameState& frame) {
    std::vector<Seen> before;  // of what has moved
    for (std::size_t i = 0; i < bounds_.size(); ++i) {
        moved_[i] = !known_ || moved(frame, i);
        if (moved_[i]) before.push_back(std::exchange(seen_[i], see(frame, i)));
    }
    const bool map_too = !known_ || before.size() > kMostMoved;
    all_ = map_too || turned_;
    turned_ = false;
    objects_.clear(), picture_.clear(), shadow_.clear();
    if (all_) objects_.fill(), picture_.fill();
    if (map_too) {
        if (views_.shadow_size > 0) shadow_ = {{0, 0, views_.shadow_size, views_.shadow_size}};
    } else {
        for (const Seen& was : before) add_moved(was);
        for (std::size_t i = 0; i < bounds_.size(); ++i)
            if (moved_[i]) add_moved(seen_[i]);
    }
    occupied_.clear();
    for (const Seen& now : seen_) occupied_.add(now.cover);
    before_ = frame;
    known_ = true;
}

void Changes::add_moved(const Seen& seen) {
    if (seen.from_light.empty()) return;
    objects_.add(seen.cover);
    if (views_.shadow_size == 0) return;
    add_to_shadow_map(in_shadow_map(seen));
}

void Changes::take(std::span<const ShadowChange> changes) {
    if (all_) return;
    for (const ShadowChange& change : changes) {
        add_receivers(change);
        add_floor(change);
    }
    picture_.add(objects_);
}

/// In the light's x and y, with room for what looks up from beside.
Eigen::AlignedBox2f Changes::around(const PixelBox& texels) const {
    const float texel = 2 / static_cast<float>(views_.shadow_size);
    const auto at = [&](int x, int y) {
        return Eigen::Vector2f(texel * static_cast<float>(x) - 1, texel * static_cast<float>(y) - 1);
    };
    return {at(texels.left, texels.bottom) - Eigen::Vector2f::Constant(pad_),
            at(texels.right, texels.top) + Eigen::Vector2f::Constant(pad_)};
}

void Changes::add_receivers(const ShadowChange& change) {
    const Eigen::AlignedBox2f outline = around(change.texels);
    Eigen::AlignedBox3f prism;
    prism.min() << outline.min(), change.nearest - depth_pad_;
    prism.max() << outline.max(), change.farthest + depth_pad_;
    for (std::size_t i = 0; i < seen_.size(); ++i) {
        if (moved_[i] || seen_[i].from_light.empty() || !prism.intersects(seen_[i].box)) continue;
        Eigen::AlignedBox3f common = prism.intersection(seen_[i].box);
        for (const Slab& slab : seen_[i].slabs) cut(common, slab);
        if (common.isEmpty()) continue;
        Points corners;
        corners.reserve(8);
        for (int k = 0; k < 8; ++k)
            corners.push_back(transformed(world_from_light_,
                                          common.corner(static_cast<Eigen::AlignedBox3f::CornerType>(k))));
        picture_.add_common(in_picture(corners), seen_[i].cover);
    }
}

void Changes::add_floor(const ShadowChange& change) {
    const Eigen::Vector3f ray = world_from_light_.block<3, 1>(0, 2);
    if (std::abs(ray.y()) < 1e-3f * ray.norm()) {  // light that grazes the floor
        picture_.fill();
        return;
    }
    const Eigen::AlignedBox2f outline = around(change.texels);
    Points floor;
    float nearest = std::numeric_limits<float>::infinity(), farthest = -nearest;  // in the light's z
    for (int k = 0; k < 4; ++k) {
        const Eigen::Vector2f p = outline.corner(static_cast<Eigen::AlignedBox2f::CornerType>(k));
        const Eigen::Vector3f start = transformed(world_from_light_, {p.x(), p.y(), 0});
        const float z = (views_.floor_height - start.y()) / ray.y();
        nearest = std::min(nearest, z), farthest = std::max(farthest, z);
        floor.push_back(start + z * ray);
    }
    if (nearest - depth_pad_ <= change.farthest && farthest + depth_pad_ >= change.nearest)
        picture_.add(in_picture(floor));
}

PixelBox Changes::in_shadow_map(const Seen& seen) const {
    if (seen.from_light.empty() || seen.shadow == Shadow::none) return {};
    Eigen::AlignedBox2f box;
    for (const Eigen::Vector3f& corner : seen.from_light) box.extend(corner.head<2>());
    if (seen.shadow == Shadow::widened) {
        const Eigen::Vector2f wider =
            Eigen::Vector2f::Constant(2 * views_.shadow_widening / static_cast<float>(views_.shadow_size));
        box.min() -= wider, box.max() += wider;
    }
    const auto size = static_cast<float>(views_.shadow_size);
    const auto texel = [&](float x) {
        return static_cast<int>(std::clamp(std::floor(0.5f * (x + 1) * size), -2.0f, size + 2));
    };
    const auto within = [&](int x) { return std::clamp(x, 0, views_.shadow_size); };
    return {within(texel(box.min().x()) - 1), within(texel(box.min().y()) - 1),
            within(texel(box.max().x()) + 2), within(texel(box.max().y()) + 2)};
}

/// Boxes that meet become one.
void Changes::add_to_shadow_map(PixelBox box) {
    if (box.empty()) return;
    for (std::size_t i = 0; i < shadow_.size();) {
        if (!shadow_[i].meets(box)) {
            ++i;
            continue;
        }
        box.include(shadow_[i]);
        shadow_.erase(shadow_.begin() + static_cast<std::ptrdiff_t>(i));
        i = 0;
    }
    shadow_.push_back(box);
}

std::vector<PixelBox> Changes::boxes(std::size_t object) const {
    return objects_.touched(seen_[object].cover);
}

PixelBox Changes::shadow_box(std::size_t object) const {
    return in_shadow_map(seen_[object]);
}

}  // namespace render
