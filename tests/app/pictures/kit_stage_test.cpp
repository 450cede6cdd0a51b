#include "pictures/kit_stage.h"

#include <gtest/gtest.h>
#include <render/renderer.h>

#include <random>

#include "files/assets.h"

namespace {

double random(std::mt19937& engine, double low, double high) {
    return low + (high - low) * engine() / 4294967296.0;
}

std::optional<tracking::PosePrediction> pose(std::mt19937& engine) {
    if (engine() % 8 == 0) return std::nullopt;
    tracking::PosePrediction pose;
    pose.position = {random(engine, -0.8, 0.8), random(engine, 0.5, 1.3), random(engine, -0.9, 0.2)};
    pose.orientation =
        Eigen::Quaterniond(1, random(engine, -0.5, 0.5), random(engine, -0.5, 0.5), 0).normalized();
    return pose;
}

/// Sticks anywhere among instruments of which some have just been struck: what the renderer keeps of a picture
/// and a whole one are the same to the bit.
TEST(KitStage, TwoHundredFramesOfEachKitAreTheSameDrawnWholeOrWhereTheyChange) {
    for (const char* name : {"strings", "drums", "bells", "rock", "timpani", "marimba", "harp", "pads"}) {
        const app::Kit kit = app::read_kit(app::find_kit(name));
        const app::KitStage stage(kit, 2, app::StickGeometry{}, {}, {.ghosts = true});
        const render::SceneDescription scene = stage.scene(165, 123);
        render::Renderer keeping(scene), whole(scene);
        std::mt19937 engine(7);
        render::FrameState struck = stage.frame({}, {});
        const render::FrameState rest = struck;
        render::Image kept, drawn;
        for (int k = 0; k < 200; ++k) {
            app::Annotations shown;
            shown.ghosts.resize(2);
            shown.ghosts[0].truth = pose(engine);
            render::FrameState frame = stage.frame({}, std::vector{pose(engine), pose(engine)}, 0, shown);
            for (std::size_t i = 0; i < kit.instruments.size(); ++i) {
                if (engine() % 10 == 0) struck.world_from_object[i] = rest.world_from_object[i];
                if (engine() % 10 == 0)
                    struck.world_from_object[i](1, static_cast<int>(engine() % 4)) +=
                        float(random(engine, -0.01, 0.01));
                frame.world_from_object[i] = struck.world_from_object[i];
            }
            keeping.draw(frame, kept);
            whole.forget();
            whole.draw(frame, drawn);
            ASSERT_TRUE(kept.rgb == drawn.rgb) << name << ", frame " << k;
        }
    }
}

TEST(KitStage, ABodyThatHasRungOutToWithin50MicrometresIsDrawnAtRest) {
    const app::Kit kit = app::read_kit(app::find_kit("drums"));
    const app::KitStage stage(kit, 0, app::StickGeometry{});
    const render::FrameState rest = stage.frame({}, {});
    std::vector<sim::ModalState> bodies(kit.instruments.size());
    for (sim::ModalState& body : bodies) body.q[0] = 1e-5;  // of half a metre at most: 5 micrometres
    EXPECT_EQ(stage.frame(bodies, {}).world_from_object, rest.world_from_object);
    for (sim::ModalState& body : bodies) body.q[0] = 1e-2;
    EXPECT_NE(stage.frame(bodies, {}).world_from_object[0], rest.world_from_object[0]);
}

}  // namespace
