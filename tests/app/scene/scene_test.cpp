#include "scene/scene.h"

#include <gtest/gtest.h>
#include <sim/surface_mesh.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "kit/kit.h"
#include "written_scene.h"

namespace app {
namespace {

using Eigen::Vector3d;

const std::string kBall = "[[body]]\nname = \"ball\"\nradius = 0.5\n";

TEST(Scene, ABallWithDefaultsIsReadInSiUnits) {
    const Scene scene = WrittenScene(kBall).read();
    ASSERT_EQ(scene.world.bodies.size(), 1u);
    const sim::WorldBody& ball = scene.world.bodies[0];
    EXPECT_EQ(ball.shape.base.semi_axes, Vector3d(0.5, 0.5, 0.5));
    EXPECT_EQ(ball.triangles, 360);
    EXPECT_EQ(ball.fidelity.fidelity, sim::Fidelity::automatic);
    EXPECT_EQ(scene.world.settings.dt, 1.0 / 60);
    EXPECT_EQ(scene.world.settings.gravity, Vector3d(0, -9.81, 0));
    EXPECT_TRUE(scene.world.planes.empty());
    EXPECT_EQ(scene.world.constraints.size() + scene.events.size() + scene.later.size(), 0u);
}

TEST(Scene, ABodySaysItsShapeMatterMotionAndFidelity) {
    const Scene scene = WrittenScene(R"(
[material.rubber]
young_pa = 2e5
damping_beta = 0.002
[[body]]
name = "spiky"
size = [0.4, 0.6, 0.8]
exponents = [0.3, 1.2]
bumps = [ { direction = [1, 2, 0], height = 0.1, width_deg = 18 } ]
material = "rubber"
fidelity = "modal"
modes = 14
position = [1, 2, 3]
tilt_deg = [0, 90, 0]
velocity = [4, 5, 6]
spin = [7, 8, 9]
look = { color = [0.1, 0.2, 0.3] }
)")
                            .read();
    const sim::WorldBody& body = scene.world.bodies[0];
    EXPECT_EQ(body.shape.base.semi_axes, Vector3d(0.2, 0.3, 0.4));
    EXPECT_EQ(body.shape.base.e1, 0.3);
    EXPECT_EQ(body.shape.base.e2, 1.2);
    ASSERT_EQ(body.shape.bumps.size(), 1u);
    EXPECT_NEAR(body.shape.bumps[0].width_rad, M_PI / 10, 1e-15);
    EXPECT_EQ(body.material.young_pa, 2e5);
    EXPECT_EQ(body.damping_beta, 0.002);
    EXPECT_EQ(body.fidelity.modes, 14);
    EXPECT_EQ(body.velocity, Vector3d(4, 5, 6));
    EXPECT_EQ(body.angular_velocity, Vector3d(7, 8, 9));
    // A quarter turn about y takes the body's x axis to -z.
    EXPECT_LT((body.world_from_body * Vector3d(1, 0, 0) - Vector3d(1, 2, 2)).norm(), 1e-12);
    EXPECT_EQ(scene.looks[0].appearance.color, Eigen::Vector3f(0.1f, 0.2f, 0.3f));
}

TEST(Scene, DefaultsStandUnderEveryBodyKeyByKey) {
    const Scene scene =
        WrittenScene("[defaults]\nfriction = 0.9\nlook = { roughness = 0.7 }\n" + kBall +
                     "look = { color = [1, 0, 0] }\n[[body]]\nname = \"b\"\nradius = 1\nfriction = 0.1\n")
            .read();
    EXPECT_EQ(scene.world.bodies[0].friction, 0.9);
    EXPECT_EQ(scene.world.bodies[1].friction, 0.1);
    EXPECT_EQ(scene.looks[0].appearance.roughness, 0.7f);
    EXPECT_EQ(scene.looks[0].appearance.color, Eigen::Vector3f(1, 0, 0));
}

TEST(Scene, AGridOf3x2x2GivesTwelveCopiesOfOneKindWithinTheirJitter) {
    const std::string text =
        kBall +
        "position = [0, 5, 0]\ngrid = { count = [3, 2, 2], step = [2, 3, 4], jitter = 0.1, "
        "turned = true, seed = ";
    const Scene scene = WrittenScene(text + "1 }\n").read(), again = WrittenScene(text + "1 }\n").read();
    const Scene other = WrittenScene(text + "2 }\n").read();
    ASSERT_EQ(scene.world.bodies.size(), 12u);
    for (std::size_t k = 0; k < 12; ++k) {
        const sim::WorldBody& body = scene.world.bodies[k];
        EXPECT_EQ(body.name, "ball/" + std::to_string(k));
        const Vector3d cell(2.0 * (double(k % 3) - 1), 5 + 3.0 * double(k / 3 % 2),
                            4.0 * (double(k / 6) - 0.5));
        EXPECT_LE((body.world_from_body.translation() - cell).cwiseAbs().maxCoeff(), 0.1);
        EXPECT_NEAR(body.world_from_body.linear().determinant(), 1, 1e-12);
        EXPECT_EQ(scene.looks[k].kind, 0u);
        EXPECT_TRUE(body.world_from_body.isApprox(again.world.bodies[k].world_from_body, 0));
        EXPECT_FALSE(body.world_from_body.isApprox(other.world.bodies[k].world_from_body, 1e-3));
    }
}

TEST(Scene, ABoxIsAFloorAndFourWallsThatLookInwards) {
    const Scene scene =
        WrittenScene(kBall + "[box]\nsize = [4, 6]\ncenter = [1, -2]\nfloor = 0.5\nfriction = 0.3\n").read();
    ASSERT_EQ(scene.world.planes.size(), 5u);
    const auto height = [&](const Vector3d& at) {  // over the nearest plane
        double least = 1e9;
        for (const sim::WorldPlane& p : scene.world.planes)
            least = std::min(least, p.normal.dot(at) - p.offset);
        return least;
    };
    EXPECT_NEAR(height({1, 10, -2}), 2, 1e-12);
    EXPECT_NEAR(height({2.9, 10, -2}), 0.1, 1e-12);
    EXPECT_NEAR(height({-0.9, 10, -2}), 0.1, 1e-12);
    EXPECT_NEAR(height({1, 10, 0.9}), 0.1, 1e-12);
    EXPECT_NEAR(height({1, 10, -4.9}), 0.1, 1e-12);
    EXPECT_NEAR(height({1, 0.7, -2}), 0.2, 1e-12);
}

const std::string kTwo =
    "[[body]]\nname = \"a\"\nradius = 0.5\nposition = [1, 2, 3]\ntilt_deg = [0, 0, 90]\n"
    "[[body]]\nname = \"b\"\nradius = 0.5\nposition = [2, 2, 3]\n";

TEST(Scene, ConstraintsGivenByAPlaceMeetThereAtTheStart) {
    const Scene scene =
        WrittenScene(kTwo +
                     "[[constraint]]\nname = \"tie\"\nbody = \"a\"\nto = \"b\"\nat = [1.5, 2, 3]\n"
                     "[[constraint]]\nbody = \"a\"\npoint = [0.5, 0, 0]\n"
                     "[[constraint]]\nbody = \"b\"\nplace = [2, 4, 3]\nstiffness = 7\n"
                     "[[constraint]]\nbody = \"a\"\nto = \"b\"\npoint = [0.1, 0.2, 0.3]\n")
            .read();
    const auto& c = scene.world.constraints;
    const auto& bodies = scene.world.bodies;
    ASSERT_EQ(c.size(), 4u);
    EXPECT_LT((bodies[0].world_from_body * c[0].point_a - Vector3d(1.5, 2, 3)).norm(), 1e-12);
    EXPECT_LT((bodies[1].world_from_body * c[0].point_b - Vector3d(1.5, 2, 3)).norm(), 1e-12);
    EXPECT_EQ(c[1].body_b, -1);  // held where it is: the body's x axis points up
    EXPECT_LT((c[1].point_b - Vector3d(1, 2.5, 3)).norm(), 1e-12);
    EXPECT_EQ(c[2].point_b, Vector3d(2, 4, 3));
    EXPECT_EQ(c[2].point_a, Vector3d(0, 0, 0));
    EXPECT_EQ(c[2].stiffness, 7);
    EXPECT_TRUE(std::isinf(c[2].breaking_force));
    EXPECT_LT((bodies[1].world_from_body * c[3].point_b - bodies[0].world_from_body * c[3].point_a).norm(),
              1e-12);
}

TEST(Scene, HingesAndSlidersHaveTheirAxisInBothBodiesFrames) {
    const Scene scene =
        WrittenScene(kTwo +
                     "[[constraint]]\nbody = \"a\"\nto = \"b\"\nat = [1.5, 2, 3]\ntype = \"hinge\"\n"
                     "axis = [0, 0, 2]\ncollide = false\n"
                     "[[constraint]]\nbody = \"a\"\ntype = \"slider\"\naxis = [1, 1, 0]\nstiffness = 5\n")
            .read();
    const auto& c = scene.world.constraints;
    const auto& bodies = scene.world.bodies;
    ASSERT_EQ(c.size(), 2u);
    const Vector3d x = Vector3d::UnitX();
    EXPECT_EQ(c[0].joint, sim::Joint::hinge);
    EXPECT_LT((bodies[0].world_from_body.rotation() * (c[0].frame_a * x) - Vector3d(0, 0, 1)).norm(), 1e-12);
    EXPECT_LT((bodies[1].world_from_body.rotation() * (c[0].frame_b * x) - Vector3d(0, 0, 1)).norm(), 1e-12);
    EXPECT_LT((bodies[0].world_from_body.rotation() * (c[0].frame_a * Vector3d(0, 1, 0)) -
               bodies[1].world_from_body.rotation() * (c[0].frame_b * Vector3d(0, 1, 0)))
                  .norm(),
              1e-12);
    EXPECT_EQ(c[0].collide, std::optional(false));
    EXPECT_TRUE(std::isinf(c[0].stiffness));
    EXPECT_EQ(c[1].joint, sim::Joint::slider);
    EXPECT_LT((c[1].frame_b * x - Vector3d(1, 1, 0).normalized()).norm(), 1e-12);
    EXPECT_EQ(c[1].collide, std::nullopt);
    EXPECT_EQ(c[1].stiffness, 5);
}

TEST(Scene, PushesHaveTheirTimeAndNameBodiesThatComeLater) {
    const Scene scene =
        WrittenScene(
            kTwo +
            "[[event]]\ntime = 2\nadd = { name = \"c\", radius = 0.1 }\n"
            "[[event]]\ntime = 1.0041\nadd = { name = \"d\", radius = 0.1 }\n"
            "[[event]]\ntime = 1.0041\npush = { body = \"b\", point = [0, 0.5, 0], force = [1, 2, 3], "
            "seconds = 0.25, axes = \"body\" }\n"
            "[[event]]\nstep = 150\npush = { body = \"c\", impulse = [0, 5, 0] }\n")
            .read();
    EXPECT_EQ(scene.events.size(), 2u);  // a push is no event of the world's
    const auto& f = scene.world.forces;
    ASSERT_EQ(f.size(), 2u);
    EXPECT_EQ(f[0].body, 1);
    EXPECT_EQ(f[0].point, Vector3d(0, 0.5, 0));
    EXPECT_EQ(f[0].force, Vector3d(1, 2, 3));
    EXPECT_TRUE(f[0].turns);
    EXPECT_DOUBLE_EQ(f[0].from_s, 1.0041);
    EXPECT_DOUBLE_EQ(f[0].until_s, 1.2541);
    EXPECT_EQ(f[1].body, 3);  // c comes after d
    EXPECT_FALSE(f[1].turns);
    EXPECT_DOUBLE_EQ(f[1].from_s, 2.5);
    EXPECT_EQ(f[1].from_s, f[1].until_s);
}

TEST(Scene, AMotionBeginsWhereTheBodyIs) {
    const Scene scene =
        WrittenScene(
            "[[body]]\nname = \"a\"\nradius = 0.5\nposition = [1, 2, 3]\n"
            "motion = [{ time = 1, position = [2, 2, 3] }, { time = 2, tilt_deg = [0, 90, 0] }]\n"
            "[[event]]\ntime = 3\n[event.add]\nname = \"b\"\nradius = 0.1\nposition = [5, 0, 0]\n"
            "motion = [{ time = 4, position = [6, 0, 0] }]\n")
            .read();
    const auto& motion = scene.world.bodies[0].motion;
    ASSERT_EQ(motion.size(), 3u);
    EXPECT_EQ(motion[0].time_s, 0);
    EXPECT_EQ(motion[0].position, Vector3d(1, 2, 3));
    EXPECT_EQ(motion[1].position, Vector3d(2, 2, 3));
    EXPECT_LT((motion[2].orientation * Vector3d(0, 0, 1) - Vector3d(1, 0, 0)).norm(), 1e-12);
    ASSERT_EQ(scene.later[0].motion.size(), 2u);
    EXPECT_EQ(scene.later[0].motion[0].time_s, 3);
    EXPECT_EQ(scene.later[0].motion[0].position, Vector3d(5, 0, 0));
}

TEST(Scene, PushesMotionsAndJointsThatCannotBeAreRefusedWhereTheyStand) {
    const auto refused = [](const std::string& text, const std::string& found) {
        EXPECT_NE(WrittenScene(kTwo + text).refusal().find(found), std::string::npos)
            << WrittenScene(kTwo + text).refusal();
    };
    const std::string event = "[[event]]\ntime = 1\npush = { body = ";
    refused(event + "\"x\", impulse = [1, 0, 0] }\n", ":12:8: error: found body = \"x\"");
    refused(event + "\"a\" }\n", "neither force nor impulse");
    refused(event + "\"a\", force = [1, 0, 0] }\n", "a force without seconds");
    refused(event + "\"a\", impulse = [1, 0, 0], seconds = 1 }\n", "an impulse with seconds");
    refused("motion = [{ time = 2 }, { time = 2 }]\n", "time = 2");
    refused("motion = [{ time = 1 }]\ngrid = { count = [2, 1, 1], step = [1, 1, 1] }\n",
            "a motion of the copies of a grid");
    refused("[[event]]\ntime = 3\nadd = { name = \"c\", radius = 1, motion = [{ time = 2 }] }\n",
            "expected a time after 3 s");
    refused("[[constraint]]\nbody = \"a\"\ntype = \"hinge\"\n", "no key \"axis\"");
    refused("[[constraint]]\nbody = \"a\"\naxis = [1, 0, 0]\n", "the axis of a ball");
    refused("[[constraint]]\nbody = \"a\"\ntype = \"slider\"\naxis = [0, 0, 0]\n", "axis = [0, 0, 0]");
}

TEST(Scene, MigrationStartsOnOneWorkerTradesFromStep50AndLoadsAWorkerFromStep150) {
    const Scene scene = read_scene(find_scene("migration30"));
    EXPECT_TRUE(scene.workers.all_to_first);
    EXPECT_EQ(scene.workers.balance_from, 50u);
    ASSERT_EQ(scene.events.size(), 1u);
    EXPECT_EQ(scene.events[0].step, 150u);
    EXPECT_GT(scene.events[0].slowing.at(0).factor, 1);
    EXPECT_FALSE(WrittenScene(kBall).read().workers.all_to_first);
}

TEST(Scene, EventsComeInOrderOfStepsAndLaterBodiesAreNumberedSo) {
    const std::string text =
        kTwo +
        "[[constraint]]\nname = \"x\"\nbody = \"a\"\n[[constraint]]\nname = \"y\"\nbody = \"b\"\n"
        "[[event]]\ntime = 2\nadd = { name = \"second\", radius = 1 }\n"
        "[[event]]\nstep = 30\ndelete = \"y\"\nadd = { name = \"first\", radius = 1, grid = { "
        "count = [2, 1, 1], step = [3, 0, 0] } }\n"
        "[[event]]\ntime = \"1/2\"\ndelete = [\"x\", \"y\"]\nslow = { worker = 2, factor = 3 }\n";
    const WrittenScene written(text);
    const Scene scene = written.read();
    ASSERT_EQ(scene.events.size(), 3u);
    EXPECT_EQ(scene.events[0].step, 30u);
    EXPECT_EQ(scene.events[0].removed, std::vector<int>{1});
    EXPECT_EQ(scene.events[1].step, 30u);
    EXPECT_EQ(scene.events[1].removed, (std::vector<int>{0, 1}));
    EXPECT_EQ(scene.events[1].slowing.at(0).factor, 3);
    EXPECT_EQ(scene.events[2].step, 120u);
    ASSERT_EQ(scene.later.size(), 3u);
    EXPECT_EQ(scene.later[0].name, "first/0");
    EXPECT_EQ(scene.later[2].name, "second");
    EXPECT_EQ(scene.events[2].first, 2u);
    EXPECT_EQ(scene.looks.size(), 5u);

    const Scene slow = written.read(0.05);
    EXPECT_EQ(slow.world.settings.dt, 0.05);
    EXPECT_EQ(slow.events[0].step, 10u);  // 0.5 s; the one by its step comes after it now
    EXPECT_EQ(slow.events[2].step, 40u);
    EXPECT_EQ(slow.later[0].name, "first/0");
}

TEST(Scene, WrongOnesAreRefusedAtTheirPlaceInOneLine) {
    struct Case {
        std::string text, place, words;
    };
    const std::vector<Case> cases = {
        {"", ":1:1:", "no [[body]]"},
        {"[[body]]\n", ":1:1:", "no key \"name\""},
        {"[[body]]\nname = \"\"\nradius = 1\n", ":2:8:", "a name"},
        {"[[body]]\nname = \"a\"\n", ":1:1:",
         "no key \"size\" in body \"a\", expected [3 numbers, each from 0.001 to 100], or \"radius\""},
        {"[[body]]\nname = \"a\"\nradius = 1\nsize = [1, 1, 1]\n", ":3:10:", "one of them"},
        {"[[body]]\nname = \"a\"\nsize = [1, 0, 1]\n", ":3:12:", "each from 0.001"},
        {"[[body]]\nname = \"a\"\nradius = nan\n", ":3:10:", "a number from"},
        {"[[body]]\nname = \"a\"\nradius = 1\nexponents = [2, 1]\n", ":4:14:", "0.1 to 1.9"},
        {"[[body]]\nname = \"a\"\nradius = 1\nmaterial = \"steel\"\n", ":4:12:", "[material.NAME]"},
        {"[material.x]\n[[body]]\nname = \"a\"\nradius = 1\nmaterial = \"steel\"\n", ":5:12:", "one of x"},
        {"[material.x]\npoisson = 0.5\n" + kBall, ":2:11:", "to 0.495"},
        {"[[body]]\nname = \"a\"\nradius = 1\nfidelity = \"best\"\n", ":4:12:", "one of rigid"},
        {kBall + "bumps = [ { direction = [0, 0, 0], height = 0.1 } ]\n", ":4:25:", "a direction"},
        {kBall + "bumps = [ { direction = [0, 1, 0], height = 9 } ]\n", ":4:45:", "to 1"},
        {kBall + "modes = 76\n", ":4:9:", "at most 75"},
        {kBall + "triangles = 47\n", ":4:13:", "48"},
        {kBall + "grid = { count = [101, 100, 1], step = [1, 1, 1] }\n", ":4:18:", "10000"},
        {kBall + "grid = { count = [1.5, 1, 1], step = [1, 1, 1] }\n", ":4:18:", "not whole"},
        {kBall + kBall, ":4:1:", "a second body \"ball\""},
        {kBall + "colour = 1\n", ":4:1:", "unknown key \"colour\""},
        {kBall + "[[plane]]\nnormal = [0, 0, 0]\n", ":5:10:", "a direction"},
        {kBall + "[box]\n", ":4:1:", "no key \"size\""},
        {kBall + "[[constraint]]\nbody = \"b\"\n", ":5:8:", "the name of a [[body]]"},
        {kBall + "[[constraint]]\nbody = \"ball\"\nto = \"ball\"\n", ":6:6:", "another body"},
        {kBall + "[[constraint]]\nbody = \"ball\"\nat = [0, 0, 0]\nplace = [0, 0, 0]\n",
         ":6:6:", "both at and place"},
        {kBall + "[[constraint]]\nbody = \"ball\"\nto_point = [0, 0, 0]\n", ":6:12:", "without to"},
        {kTwo + "[[constraint]]\nbody = \"a\"\nto = \"b\"\nplace = [0, 0, 0]\n", ":13:9:", "beside to"},
        {kTwo + "[[constraint]]\nbody = \"a\"\nname = \"c\"\n[[constraint]]\nbody = \"b\"\nname = \"c\"\n",
         ":15:8:", "a second constraint"},
        {kBall + "[[event]]\ntime = 1\n", ":4:1:", "without effect"},
        {kBall + "[[event]]\ndelete = \"x\"\n", ":4:1:", "neither time nor step"},
        {kBall + "[[event]]\ntime = 1\nstep = 2\ndelete = \"x\"\n", ":5:8:", "both time and step"},
        {kBall + "[[event]]\ntime = 1\ndelete = \"x\"\n", ":6:10:", "the name of a [[constraint]]"},
        {kBall + "[[event]]\ntime = 1\nadd = { name = \"ball\", radius = 1 }\n", ":6:7:", "a second body"},
        {kBall + "[[event]]\ntime = 1\nslow = { worker = 1 }\n", ":6:8:", "no key \"factor\""},
        {"[settings]\ndt = 0\n" + kBall, ":2:6:", "1e-06"},
        {"[settings]\ndt = \"1/0\"\n" + kBall, ":2:6:", "a fraction"},
        {"[settings]\nsubsteps = 0\n" + kBall, ":2:12:", "a whole number"},
        {"[camera]\neye = [0, 0, 0]\ntarget = [0, 0, 0]\n" + kBall, ":3:10:", "two different points"},
        {"body = 3\n", ":1:8:", "an array of tables"},
        {"body = [1]\n", ":1:9:", "a table"},
        {"[[body]\n", ":1:8:", "a syntax error"},
    };
    for (const Case& wrong : cases) {
        const WrittenScene written(wrong.text);
        const std::string refusal = written.refusal();
        EXPECT_TRUE(refusal.starts_with(written.file().string() + wrong.place + " error: found "))
            << wrong.text << refusal;
        EXPECT_NE(refusal.find(wrong.words), std::string::npos) << wrong.text << refusal;
        EXPECT_EQ(refusal.find('\n'), std::string::npos) << refusal;
    }
}

TEST(Scene, TwoThousandMutatedOnesAreRefusedInOneLineOrMakeAWorld) {
    const std::string good =
        kTwo +
        "material = \"m\"\nfidelity = \"rigid\"\nbumps = [ { direction = [0, 1, 0], height = 0.1 } ]\n"
        "grid = { count = [2, 1, 1], step = [2, 0, 0] }\n[material.m]\nyoung_pa = 1e5\n[defaults]\n"
        "fidelity = \"rigid\"\n[settings]\ndt = \"1/60\"\n[box]\nsize = [9, 9]\n[[constraint]]\n"
        "name = \"c\"\nbody = \"a\"\nto = \"b/1\"\n[[event]]\ntime = 1\ndelete = [\"c\"]\n";
    ASSERT_EQ(WrittenScene(good).refusal(), "");
    constexpr std::string_view kSnippets[] = {
        "[",       "]",    "{", "}", "=",      "\"", "\n", "nan", "-1e308", "[[body]]", "9999999999",
        "\\u0000", "\x80", "'", "0", "1e-300", ",",  ".",  "#",   "inf",    "-"};
    std::mt19937 random(20260101);
    int refused = 0;
    for (int i = 0; i < 2000; ++i) {
        std::string text = good;
        const std::size_t at = random() % text.size();
        if (i % 3 == 0) text[at] = static_cast<char>(random() % 256);
        if (i % 3 == 1) text.erase(at, 1 + random() % 12);
        if (i % 3 == 2) text.insert(at, kSnippets[random() % std::size(kSnippets)]);
        const WrittenScene written(text);
        try {
            const Scene scene = written.read();
            const sim::World world(scene.world);
        } catch (const BadInput& wrong) {
            ++refused;
            const std::string what = wrong.what();
            EXPECT_TRUE(what.starts_with(written.file().string() + ":")) << what;
            EXPECT_NE(what.find("expected "), std::string::npos) << what;
            EXPECT_EQ(what.find('\n'), std::string::npos) << what;
        }
    }
    EXPECT_GT(refused, 1000);
    EXPECT_LT(refused, 2000);
}

Scene bundled(const std::string& name) {
    return read_scene(find_scene(name));
}

std::size_t triangles(const sim::WorldBody& body) {
    return sim::surface_mesh(body.shape, body.triangles).triangles.size();
}

TEST(BundledScenes, HumanHasTenRigidBodiesNineJointsAndOneHeldHeadThatIsLetGo) {
    const Scene scene = bundled("human");
    const auto& constraints = scene.world.constraints;
    EXPECT_EQ(scene.world.bodies.size(), 10u);
    EXPECT_EQ(
        std::count_if(constraints.begin(), constraints.end(), [](const auto& c) { return c.body_b >= 0; }),
        9);
    ASSERT_EQ(constraints.size(), 10u);
    ASSERT_EQ(scene.events.size(), 1u);
    ASSERT_EQ(scene.events[0].removed.size(), 1u);
    const sim::PointConstraint& let_go = constraints[std::size_t(scene.events[0].removed[0])];
    EXPECT_EQ(scene.world.bodies[std::size_t(let_go.body_a)].name, "head");
    EXPECT_EQ(let_go.body_b, -1);
    for (const sim::WorldBody& body : scene.world.bodies) {
        EXPECT_EQ(body.fidelity.fidelity, sim::Fidelity::rigid);
        if (body.name != "head")
            EXPECT_EQ(triangles(body), 48u) << body.name;
        else {
            EXPECT_GE(triangles(body), 200u);
            EXPECT_LE(triangles(body), 300u);
        }
    }
}

TEST(BundledScenes, LatticeHas25Bodies40TiesAndTwelveThatAreDeleted) {
    const Scene scene = bundled("lattice");
    EXPECT_EQ(scene.world.bodies.size(), 25u);
    const auto& constraints = scene.world.constraints;
    EXPECT_EQ(
        std::count_if(constraints.begin(), constraints.end(), [](const auto& c) { return c.body_b >= 0; }),
        40);
    ASSERT_EQ(scene.events.size(), 1u);
    EXPECT_EQ(scene.events[0].removed.size(), 12u);
    for (const sim::WorldBody& body : scene.world.bodies) EXPECT_EQ(triangles(body), 48u);
}

TEST(BundledScenes, SpikedHasThreeSpikedModalBodiesOf200To300Polygons) {
    const Scene scene = bundled("spiked");
    ASSERT_EQ(scene.world.bodies.size(), 3u);
    for (const sim::WorldBody& body : scene.world.bodies) {
        EXPECT_EQ(body.fidelity.fidelity, sim::Fidelity::modal);
        EXPECT_GE(body.shape.bumps.size(), 4u);
        EXPECT_GE(triangles(body), 200u);
        EXPECT_LE(triangles(body), 300u);
    }
}

TEST(BundledScenes, BenchmarksHaveTheirNumberOfBodiesOfRadiusHalfAMetre12ModesAnd360Polygons) {
    const std::map<std::string, std::size_t> scenes = {{"benchmark25", 25},
                                                       {"benchmark100", 100},
                                                       {"benchmark400", 400},
                                                       {"benchmark1600", 1600},
                                                       {"migration30", 30}};
    for (const auto& [name, count] : scenes) {
        const Scene scene = bundled(name);
        ASSERT_EQ(scene.world.bodies.size(), count) << name;
        EXPECT_EQ(scene.world.planes.size(), 5u);
        for (const sim::WorldBody& body : scene.world.bodies) {
            EXPECT_EQ(body.shape.base.semi_axes, Vector3d(0.5, 0.5, 0.5));
            EXPECT_EQ(body.fidelity.fidelity, sim::Fidelity::modal);
            EXPECT_EQ(body.fidelity.modes, 12);
            for (const sim::WorldPlane& plane : scene.world.planes)
                EXPECT_GE(plane.normal.dot(body.world_from_body.translation()) - plane.offset, 0.5)
                    << name << body.name;
        }
        EXPECT_EQ(triangles(scene.world.bodies[0]), 360u);
        EXPECT_EQ(std::llround(scene.seconds / scene.world.settings.dt), 500) << name;
    }
}

}  // namespace
}  // namespace app
