#include <mujoco/mujoco.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstring>
#include <stdexcept>

#include "rigid_peer.h"

namespace sim_bench {
namespace {

std::string number(double x) {
    std::array<char, 32> text;
    return {text.data(), static_cast<std::size_t>(std::snprintf(text.data(), text.size(), "%.17g", x))};
}
std::string numbers(const Eigen::Vector3d& v) {
    return number(v.x()) + " " + number(v.y()) + " " + number(v.z());
}
std::string numbers(const Eigen::Quaterniond& q) {
    return number(q.w()) + " " + number(q.x()) + " " + number(q.y()) + " " + number(q.z());
}
std::string attribute(const char* name, const std::string& value) {
    return std::string(" ") + name + "=\"" + value + "\"";
}

/// A world as MuJoCo's XML. Bodies that hang together without a loop become a tree of ball joints, so that
/// the joints hold exactly; what closes a loop is an equality.
class Description {
public:
    Description(const sim::WorldDefinition& world, const PeerSettings& settings)
        : world_(world), settings_(settings), places_(world.bodies.size()) {
        find_tree();
    }

    [[nodiscard]] std::string xml() const {
        const std::string solref = number(2 * settings_.dt) + " 1";
        // A contact is rows of four edges.
        const std::size_t contacts = std::size_t(settings_.contacts_per_body) * (world_.bodies.size() + 1),
                          rows = 4 * contacts;
        std::string text =
            "<mujoco>\n<compiler angle=\"radian\"/>\n<size" + attribute("nconmax", std::to_string(contacts)) +
            attribute("njmax", std::to_string(rows)) +
            attribute("nstack", std::to_string(100'000 + 2 * rows * rows)) + "/>\n<option" +
            attribute("timestep", number(settings_.dt)) +
            attribute("gravity", numbers(world_.settings.gravity)) +
            attribute("integrator", settings_.method) + " solver=\"Newton\" iterations=\"100\">" +
            (settings_.hulls ? "<flag multiccd=\"enable\"/>" : "") +
            "</option>\n<default><geom solimp=\"0.99 0.999 0.001\"" + attribute("solref", solref) +
            "/></default>\n";
        text += "<asset>" + meshes() + "</asset>\n<worldbody>\n";
        for (const sim::WorldPlane& plane : world_.planes)
            text += "<geom type=\"plane\" size=\"0 0 1\"" +
                    attribute("pos", numbers(Eigen::Vector3d(plane.offset * plane.normal))) +
                    attribute("zaxis", numbers(plane.normal)) + friction(plane.friction) + "/>\n";
        for (std::size_t i = 0; i < places_.size(); ++i)
            if (places_[i].parent < 0) text += body(static_cast<int>(i));
        text += "</worldbody>\n<equality>\n";
        for (const std::size_t c : loops_) text += connect(world_.constraints[c]);
        return text + "</equality>\n</mujoco>\n";
    }

private:
    struct Place {
        int parent = -1;  ///< -1: the world
        int joint = -1;   ///< constraint that a ball joint stands for; -1: moves freely
        std::vector<int> children = {};
    };

    static std::string friction(double mu) { return attribute("friction", number(mu) + " 0 0"); }

    void find_tree() {
        std::vector<bool> hangs(world_.bodies.size()), used(world_.constraints.size());
        const auto hang = [&](int child, int parent, std::size_t c) {
            Place& place = places_[static_cast<std::size_t>(child)];
            place.parent = parent, place.joint = static_cast<int>(c);
            if (parent >= 0) places_[static_cast<std::size_t>(parent)].children.push_back(child);
            hangs[static_cast<std::size_t>(child)] = used[c] = true;
        };
        const auto is_in = [&](int body) { return body < 0 || hangs[static_cast<std::size_t>(body)]; };
        for (bool changed = true; changed;) {
            changed = false;
            for (std::size_t c = 0; c < used.size(); ++c) {
                const sim::PointConstraint& held = world_.constraints[c];
                if (used[c] || is_in(held.body_a) == is_in(held.body_b)) continue;
                is_in(held.body_b) ? hang(held.body_a, held.body_b, c) : hang(held.body_b, held.body_a, c);
                changed = true;
            }
        }
        for (std::size_t c = 0; c < used.size(); ++c)
            if (!used[c]) loops_.push_back(c);
    }

    [[nodiscard]] std::string meshes() const {
        std::string text;
        for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
            if (peer_shape(world_.bodies[i], settings_.hulls) != PeerShape::hull) continue;
            std::string points;
            for (const Eigen::Vector3d& p : hull_points(world_.bodies[i])) points += numbers(p) + " ";
            text +=
                "<mesh" + attribute("name", "m" + std::to_string(i)) + attribute("vertex", points) + "/>\n";
        }
        return text;
    }

    [[nodiscard]] std::string geom(int i) const {
        const sim::WorldBody& body = world_.bodies[static_cast<std::size_t>(i)];
        const Eigen::Vector3d& half = body.shape.base.semi_axes;
        const PeerShape shape = peer_shape(body, settings_.hulls);
        const std::string form =
            shape == PeerShape::sphere ? " type=\"sphere\"" + attribute("size", number(half.x()))
            : shape == PeerShape::box  ? " type=\"box\"" + attribute("size", numbers(half))
                                       : " type=\"mesh\"" + attribute("mesh", "m" + std::to_string(i));
        return "<geom" + form + friction(body.friction) + "/>";
    }

    [[nodiscard]] std::string body(int i) const {
        const sim::WorldBody& b = world_.bodies[static_cast<std::size_t>(i)];
        const Place& place = places_[static_cast<std::size_t>(i)];
        Eigen::Isometry3d at = b.world_from_body;
        if (place.parent >= 0)
            at = world_.bodies[static_cast<std::size_t>(place.parent)].world_from_body.inverse() * at;
        const sim::RigidMass rigid = sim::rigid_mass(b.shape.base, b.material);
        std::string text = "<body" + attribute("name", "b" + std::to_string(i)) +
                           attribute("pos", numbers(Eigen::Vector3d(at.translation()))) +
                           attribute("quat", numbers(Eigen::Quaterniond(at.linear()))) + ">";
        if (place.joint >= 0) {
            const sim::PointConstraint& c = world_.constraints[static_cast<std::size_t>(place.joint)];
            text += "<joint type=\"ball\"" +
                    attribute("pos", numbers(c.body_a == i ? c.point_a : c.point_b)) + "/>";
        } else if (!b.fixed) {
            text += "<freejoint/>";
        }
        text += "<inertial pos=\"0 0 0\"" + attribute("mass", number(rigid.mass)) +
                attribute("diaginertia", numbers(rigid.inertia)) + "/>" + geom(i) + "\n";
        for (const int child : place.children) text += body(child);
        return text + "</body>\n";
    }

    [[nodiscard]] std::string connect(const sim::PointConstraint& c) const {
        return "<connect" + attribute("body1", "b" + std::to_string(c.body_a)) +
               (c.body_b < 0 ? "" : attribute("body2", "b" + std::to_string(c.body_b))) +
               attribute("anchor", numbers(c.point_a)) +
               attribute("solref", number(2 * settings_.dt) + " 1") + " solimp=\"0.99 0.999 0.001\"/>\n";
    }

    const sim::WorldDefinition& world_;
    const PeerSettings& settings_;
    std::vector<Place> places_;
    std::vector<std::size_t> loops_;  ///< constraints that the tree does not hold
};

struct Deleter {
    void operator()(mjModel* model) const { mj_deleteModel(model); }
    void operator()(mjData* data) const { mj_deleteData(data); }
    void operator()(mjVFS* files) const {
        mj_deleteVFS(files);
        delete files;
    }
};

std::unique_ptr<mjModel, Deleter> model_of(const std::string& xml) {
    const std::unique_ptr<mjVFS, Deleter> files(new mjVFS);
    mj_defaultVFS(files.get());
    const char* const name = "world.xml";
    if (mj_makeEmptyFileVFS(files.get(), name, static_cast<int>(xml.size())) != 0)
        throw std::runtime_error("error: MuJoCo has no room for a world's description");
    std::memcpy(files->filedata[mj_findFileVFS(files.get(), name)], xml.data(), xml.size());
    std::array<char, 1000> why = {};
    mjModel* const model = mj_loadXML(name, files.get(), why.data(), static_cast<int>(why.size()));
    if (!model) throw std::runtime_error(std::string("error: MuJoCo refuses a world: ") + why.data());
    return std::unique_ptr<mjModel, Deleter>(model);
}

class MujocoRigid : public RigidPeer {
public:
    MujocoRigid(const sim::WorldDefinition& definition, const PeerSettings& settings) {
        mju_user_warning = [](const char*) {};  // counted in mjData; else written to a file in this folder
        model_ = model_of(Description(definition, settings).xml());
        data_.reset(mj_makeData(model_.get()));
        for (std::size_t i = 0; i < definition.bodies.size(); ++i) {
            const int id = mj_name2id(model_.get(), mjOBJ_BODY, ("b" + std::to_string(i)).c_str());
            ids_.push_back(id);
            if (model_->body_dofnum[id] > 0) set_velocity(definition.bodies[i], id);
        }
    }

    void step() override { mj_step(model_.get(), data_.get()); }

    [[nodiscard]] std::vector<RigidState> states() override {
        for (const int full : {mjWARN_CONTACTFULL, mjWARN_CNSTRFULL})
            if (data_->warning[full].number > 0)
                throw std::runtime_error("error: MuJoCo had no room for all contacts");
        // What mj_step leaves behind is of the step's start.
        mj_kinematics(model_.get(), data_.get());
        mj_comPos(model_.get(), data_.get());
        mj_comVel(model_.get(), data_.get());
        std::vector<RigidState> all;
        for (const int id : ids_) {
            const mjtNum *p = data_->xpos + 3 * id, *q = data_->xquat + 4 * id;
            std::array<mjtNum, 6> v = {};  // angular, linear
            mj_objectVelocity(model_.get(), data_.get(), mjOBJ_BODY, id, v.data(), 0);
            all.push_back({{p[0], p[1], p[2]},
                           Eigen::Quaterniond(q[0], q[1], q[2], q[3]),
                           {v[3], v[4], v[5]},
                           {v[0], v[1], v[2]}});
        }
        return all;
    }

    [[nodiscard]] bool whole() const override {
        return data_->warning[mjWARN_BADQPOS].number + data_->warning[mjWARN_BADQVEL].number +
                   data_->warning[mjWARN_BADQACC].number ==
               0;
    }

private:
    /// Free: linear in world axes, angular in the body's; a ball joint: angular in the body's, which is all
    /// of it where the parent does not turn.
    void set_velocity(const sim::WorldBody& body, int id) {
        mjtNum* const v = data_->qvel + model_->body_dofadr[id];
        const bool free = model_->body_dofnum[id] == 6;
        const Eigen::Vector3d spin = body.world_from_body.linear().transpose() * body.angular_velocity;
        for (int k = 0; k < 3; ++k) {
            if (free) v[k] = body.velocity[k];
            v[free ? 3 + k : k] = spin[k];
        }
    }

    std::unique_ptr<mjModel, Deleter> model_;
    std::unique_ptr<mjData, Deleter> data_;
    std::vector<int> ids_;  ///< MuJoCo's, of our bodies
};

}  // namespace

bool add_mujoco(std::vector<PeerLibrary>& peers) {
    peers.push_back(
        {"MuJoCo",
         mj_versionString(),
         false,
         {"Euler", "RK4"},
         "Newton's solver, pyramidal cones (its default; with elliptic ones stacks fall at 1/60 s), contacts "
         "as stiff "
         "as it "
         "allows (solref 2 dt, solimp 0.99 0.999 0.001), integrators Euler (semi-implicit) and RK4 (the "
         "implicit "
         "one did not converge with ball joints); joints are a tree of ball joints in reduced coordinates; "
         "hulls "
         "with multiccd; this version has neither sleeping nor continuous detection; double precision",
         [](const sim::WorldDefinition& world, const PeerSettings& settings) -> std::unique_ptr<RigidPeer> {
             return std::make_unique<MujocoRigid>(world, settings);
         }});
    return true;
}

}  // namespace sim_bench
