#include "contact/island_contacts.h"

#include <algorithm>

namespace sim {

const PosedBody& IslandContacts::posed(const ContactScene& scene, int id) {
    const auto at = std::lower_bound(ids_->begin(), ids_->end(), id);
    if (at != ids_->end() && *at == id) return posed_[static_cast<std::size_t>(at - ids_->begin())];
    const MovingBody& body = scene.bodies[static_cast<std::size_t>(id)];
    if (!body.driven) return body.posed;
    const BodyPath::Pose pose = (*paths_)[static_cast<std::size_t>(id)].at(time_);
    driven_.kind = body.kind;
    driven_.set(pose.position, pose.orientation, body.state.q);
    return driven_;
}

// Pairs and planes that may be near, ascending.
void IslandContacts::list_keys(const ContactScene& scene) {
    keys_.clear();
    for (const Manifold& m : before_) keys_.push_back(m.key());
    auto key = [](int a, int b) {
        return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
    };
    for (std::size_t i = 0; i < ids_->size(); ++i) {
        const PosedBody& a = posed_[i];
        for (std::size_t j = i + 1; j < ids_->size(); ++j) {
            const PosedBody& b = posed_[j];
            const double reach = static_cast<double>(a.radius + b.radius) +
                                 (kSlop + kSlow) * std::min(smallest_half(a), smallest_half(b));
            if ((a.position - b.position).squaredNorm() < reach * reach &&
                scene.may_meet({(*ids_)[i], (*ids_)[j]}))
                keys_.push_back(key((*ids_)[i], (*ids_)[j]));
        }
        for (std::size_t p = 0; p < scene.planes.size(); ++p) {
            const WorldPlane& plane = scene.planes[p];
            const double height = plane.normal.dot(a.position) - plane.offset;
            if (height < plane.normal.cwiseAbs().dot(a.half_aabb) + (kSlop + kSlow) * smallest_half(a))
                keys_.push_back(key((*ids_)[i], kFirstPlane + static_cast<int>(p)));
        }
    }
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
}

void IslandContacts::find_pair(const ContactScene& scene, const Manifold* before, Manifold& manifold) {
    const PosedBody& a = posed(scene, manifold.a);
    if (manifold.b >= kFirstPlane) {
        const WorldPlane& plane = scene.planes[static_cast<std::size_t>(manifold.b - kFirstPlane)];
        narrow_.plane(a, plane.normal, static_cast<float>(plane.normal.dot(a.position) - plane.offset),
                      {static_cast<float>((kSlop + kSlow) * smallest_half(a)), before}, manifold);
    } else {
        const PosedBody& b = posed(scene, manifold.b);
        const double margin = (kSlop + kSlow) * std::min(smallest_half(a), smallest_half(b));
        const bool may_part = scene.may_part(scene.bodies[static_cast<std::size_t>(manifold.a)],
                                             scene.bodies[static_cast<std::size_t>(manifold.b)]);
        narrow_.pair(a, b, {static_cast<float>(margin), before, may_part}, manifold);
    }
    scene.set_surface(manifold);
}

void IslandContacts::find(const ContactScene& scene, const std::vector<int>& ids,
                          const std::vector<BodyPath>& paths, double time, std::vector<Manifold>& manifolds) {
    ids_ = &ids, paths_ = &paths, time_ = time;
    if (posed_.size() < ids.size()) posed_.resize(ids.size());
    for (std::size_t i = 0; i < ids.size(); ++i) {
        const MovingBody& body = scene.bodies[static_cast<std::size_t>(ids[i])];
        posed_[i].kind = body.kind;
        posed_[i].set(body.state.position, body.state.orientation, body.state.q);
    }
    std::swap(before_, manifolds);
    manifolds.clear();
    list_keys(scene);
    auto next = before_.begin();
    for (const std::uint64_t key : keys_) {
        // Of several impacts of a pair the last that has begun.
        const Manifold* before = nullptr;
        while (next != before_.end() && next->key() < key) ++next;
        auto later = next;
        for (; later != before_.end() && later->key() == key && later->points[0].begins <= time; ++later)
            before = &*later;
        Manifold manifold;
        manifold.a = static_cast<int>(key >> 32), manifold.b = static_cast<int>(key & 0xffffffffu);
        find_pair(scene, before, manifold);
        if (manifold.count > 0) manifolds.push_back(manifold);
        for (; later != before_.end() && later->key() == key; ++later) manifolds.push_back(*later);
        next = later;
    }
}

}  // namespace sim
