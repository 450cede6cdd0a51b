#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>

#include "sim/modes.h"
#include "sim/world.h"
#include "struck/stepped_body.h"
#include "test_kit.h"

namespace {
std::atomic<std::size_t> allocations = 0;
}

namespace {

void* counted(std::size_t size) noexcept {
    ++allocations;
    return std::malloc(size ? size : 1);
}

}  // namespace

// Not inlined: the compiler would take malloc and free here for a mistake.
[[gnu::noinline]] void* operator new(std::size_t size) {
    if (void* p = counted(size)) return p;
    throw std::bad_alloc();
}
[[gnu::noinline]] void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    return counted(size);
}
[[gnu::noinline]] void operator delete(void* p) noexcept {
    std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}
[[gnu::noinline]] void operator delete(void* p, const std::nothrow_t&) noexcept {
    std::free(p);
}
[[gnu::noinline]] void* operator new[](std::size_t size, std::align_val_t alignment) {
    ++allocations;
    const std::size_t step = static_cast<std::size_t>(alignment);
    if (void* p = std::aligned_alloc(step, (size + step - 1) / step * step)) return p;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete[](void* p, std::align_val_t) noexcept {
    std::free(p);
}

// Eigen allocates by malloc, not by operator new. The sanitizers have a malloc of their own.
#ifndef __SANITIZE_ADDRESS__
extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
    ++allocations;
    return __libc_malloc(size);
}
#endif

namespace {

TEST(SteppedBody, ModalStepSweepAndPicturesOfAWarmBodyAllocateNothing) {
    sim_test::Scenario scenario(4);
    const auto simulation = sim::make_local_simulation(scenario.bodies());
    std::vector<sim::SteppedBody> bodies;
    for (std::uint32_t i = 0; i < scenario.bodies().size(); ++i) bodies.emplace_back(i, scenario.bodies()[i]);
    std::vector<sim::BodyOutcome> outcomes(bodies.size());
    for (sim::BodyOutcome& outcome : outcomes)
        outcome.contacts.reserve(16), outcome.clearance_m.reserve(4), outcome.pictures.reserve(4);
    std::size_t contacts = 0;
    for (int i = 0; i < 200; ++i) {
        const sim::StepRequest request = scenario.next();
        const std::size_t before = allocations;
        for (std::size_t b = 0; b < bodies.size(); ++b) bodies[b].step(request, outcomes[b]);
        ASSERT_EQ(allocations, before);
        const sim::StepReply reply = simulation->step(request);
        contacts += reply.contacts.size();
        scenario.learn(reply);
    }
    EXPECT_GT(contacts, 50u);
}

TEST(ModalBasis, DisplacementAndItsInverseAllocateNothing) {
    const sim::ModalBasis basis =
        sim::free_vibration_modes({{{0.3, 0.2, 0.5}, 1, 1}, sim::ModeDomain::superquadric, {}, 2, 12}).basis;
    const Eigen::VectorXd q = Eigen::VectorXd::Constant(12, 0.01), nodal = basis.nodal * q;
    const std::size_t before = allocations;
    for (int i = 0; i < 100; ++i) {
        const Eigen::Vector3d r(0.003 * i, 0.1, -0.005 * i);
        const Eigen::Vector3d x = r + sim::displacement_at(basis, nodal, r).value;
        EXPECT_LT((sim::inverse_displacement(basis, nodal, x).r - r).norm(), 1e-9);
    }
    EXPECT_EQ(allocations, before);
}

TEST(Allocations, ThatEigenMakesAreCounted) {
#ifdef __SANITIZE_ADDRESS__
    GTEST_SKIP() << "malloc is the sanitizer's";
#endif
    const std::size_t before = allocations;
    Eigen::VectorXd values(12);
    values.setOnes();
    EXPECT_GT(allocations, before) << values.sum();
}

TEST(World, AWarmStepOfAPileAllocatesNothing) {
    sim::WorldDefinition definition;
    definition.planes.push_back({});
    definition.settings.sleeping = false;
    for (int i = 0; i < 6; ++i) {
        sim::WorldBody body;
        body.name = "ball";
        body.shape.base.semi_axes.setConstant(0.5);
        body.fidelity.fidelity = i % 3 == 0   ? sim::Fidelity::rigid
                                 : i % 3 == 1 ? sim::Fidelity::linear
                                              : sim::Fidelity::modal;
        body.world_from_body.translation() = Eigen::Vector3d(0.1 * i, 0.6 + 1.1 * i, 0);
        definition.bodies.push_back(body);
    }
    sim::WorldBody door = definition.bodies[2], belt = definition.bodies[0];
    door.world_from_body.translation() = Eigen::Vector3d(5, 1, 0);
    belt.world_from_body.translation() = Eigen::Vector3d(0, 0.5, 1.1);
    for (int k = 0; k < 1000; ++k) belt.motion.push_back({0.03 * k, {0.001 * (k % 2), 0.5, 1.1}});
    definition.bodies.insert(definition.bodies.end(), {door, belt});
    sim::PointConstraint hinge;
    hinge.joint = sim::Joint::hinge, hinge.body_a = 6, hinge.point_b = {5, 1, 0};
    definition.constraints.push_back(hinge);
    for (const int i : {2, 6}) definition.forces.push_back({i, {0, 0.1, 0}, {0.01, 0, 0}, true, 0, 100});
    sim::World world(definition);
    for (int i = 0; i < 600; ++i) world.step();  // bodies have met in all groups that they form
    const std::size_t before = allocations;
    int contacts = 0;
    for (int i = 0; i < 300; ++i) {
        world.step();
        contacts += world.counts().contacts;
    }
    EXPECT_EQ(allocations, before);
    EXPECT_GT(contacts, 600) << "there was something to do";
}

}  // namespace
