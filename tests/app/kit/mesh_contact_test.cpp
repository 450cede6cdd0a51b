#include "kit/mesh_contact.h"

#include <gtest/gtest.h>

#include <fstream>
#include <span>

#include "kit/kit.h"
#include "temporary_folder.h"

namespace app {
namespace {

/// A box of 1.2 x 0.4 x 0.8, each face two triangles; corners by bits x, y, z. Open: without its last side.
std::string box_obj(bool inwards, bool open = false) {
    std::string text;
    for (int i = 0; i < 8; ++i)
        text += "v " + std::string((i & 1) != 0 ? "0.6 " : "-0.6 ") + ((i & 2) != 0 ? "0.2 " : "-0.2 ") +
                ((i & 4) != 0 ? "0.4\n" : "-0.4\n");
    const int sides[6][4] = {{1, 3, 4, 2}, {5, 6, 8, 7}, {1, 2, 6, 5},
                             {3, 7, 8, 4}, {1, 5, 7, 3}, {2, 4, 8, 6}};
    for (const auto& [a, b, c, d] : std::span(sides).first(open ? 5 : 6)) {
        const int corners[4] = {a, inwards ? d : b, c, inwards ? b : d};
        text += "f";
        for (const int corner : corners) text += " " + std::to_string(corner);
        text += "\n";
    }
    return text;
}

TEST(MeshContact, AMeshThatIsInsideOutIsStruckLikeTheSameOneTurned) {
    const TemporaryFolder folder;
    const auto fitted = [&](bool inwards) {
        std::ofstream(folder.path() / "box.obj") << box_obj(inwards);
        std::ofstream(folder.path() / "kit.toml")
            << "[[instrument]]\nname = \"box\"\nkind = \"bell\"\nsize = [1, 1, 1]\nposition = [0, 1, 0]\n"
               "mesh = \"box.obj\"\nmesh_scale = 1\nshape = \"mesh\"\n";
        const Kit kit = read_kit(folder.path() / "kit.toml");
        const Instrument& box = kit.instruments.front();
        EXPECT_EQ(outer_surface(render::load_mesh(box.mesh), box.body_from_mesh).inside_out, inwards);
        return box.body.shape.semi_axes;
    };
    const Eigen::Vector3d outwards = fitted(false), inwards = fitted(true);
    EXPECT_NEAR((outwards - inwards).norm(), 0, 1e-3) << "its faces are cut along the other diagonal";
    EXPECT_NEAR(outwards.x(), 0.6, 0.03);
    EXPECT_NEAR(outwards.y(), 0.2, 0.03);
}

TEST(MeshContact, OfAnOpenMeshNoSideIsTheInside) {
    const TemporaryFolder folder;
    for (const bool turned : {false, true}) {
        std::ofstream(folder.path() / "box.obj") << box_obj(turned, true);
        const render::Mesh mesh = render::load_mesh(folder.path() / "box.obj");
        EXPECT_FALSE(outer_surface(mesh, Eigen::Affine3d::Identity()).inside_out);
    }
}

}  // namespace
}  // namespace app
