#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>

#include "learned/model_of_random_weights.h"
#include "tracking/contact_times.h"
#include "tracking/known_motion.h"
#include "tracking/predictor.h"

namespace {

std::atomic<long> allocations{0};

void* counted(std::size_t size, std::size_t alignment) {
    ++allocations;
    const std::size_t rounded = (size + alignment - 1) / alignment * alignment;
    void* memory = std::aligned_alloc(alignment, rounded == 0 ? alignment : rounded);
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
}

}  // namespace

void* operator new(std::size_t size) {
    return counted(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size) {
    return counted(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
    return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
    return counted(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
    return counted(size, alignof(std::max_align_t));
}
void operator delete(void* memory) noexcept {
    std::free(memory);
}
void operator delete[](void* memory) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}
void operator delete[](void* memory, std::size_t) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
    std::free(memory);
}
void operator delete[](void* memory, std::align_val_t) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
    std::free(memory);
}
void operator delete[](void* memory, std::size_t, std::align_val_t) noexcept {
    std::free(memory);
}

namespace tracking {
namespace {

TEST(Allocation, CorrectAndPredictOfEveryPredictorAllocateNothing) {
    const auto greatest =
        std::make_shared<const PathModel>(model_of_random_weights(PathModel::kMostHidden, 1));
    std::vector<std::string> names = predictor_names();
    names.insert(names.end(), model_predictor_names().begin(), model_predictor_names().end());
    for (const std::string& name : names) {
        const long before_making = allocations;
        const auto predictor = make_predictor(name, Eigen::Vector3d::UnitY(), greatest);
        EXPECT_GT(allocations, before_making);  // the counter counts
        double sum = 0;
        const long before = allocations;
        for (int i = 0; i < 2000; ++i) {
            PoseSample sample;
            sample.t_s = i * 0.008 + (i % 500 == 0 ? 0.2 : 0.0);  // with gaps and samples that are not newer
            sample.position = {std::sin(i * 0.1), i % 97 == 0 ? 30.0 : 1.0, 0};
            sample.orientation =
                Eigen::Quaterniond(Eigen::AngleAxisd(std::sin(i * 0.05), Eigen::Vector3d::UnitX()));
            sample.has_orientation = i % 5 != 0;
            (void)predictor->correct(sample);
            sum += predictor->predict(1.0 / 15).position.x();
            if (const auto covariance = predictor->covariance(1.0 / 15)) sum += covariance->position(0, 0);
        }
        EXPECT_EQ(allocations, before) << name;
        EXPECT_TRUE(std::isfinite(sum));
    }
}

TEST(Allocation, LookingAtPlanesAllocatesNothing) {
    PathModel model;
    model.contacts = model_of_random_contacts(PathModel::kMostHidden, 1);
    TipHistory history(-Eigen::Vector3d::UnitZ(), {0, 0, -0.3});
    TipView view;
    double sum = 0;
    const long before = allocations;
    for (int i = 0; i < 500; ++i) {
        if (i == 250) history.restart();
        history.push({i * 0.008, {0, 1 + 0.1 * std::sin(i * 0.1), 0}});
        if (history.look(view)) sum += contact_times(model, view, {{0, 0.95, 0}, {0, 1, 0}}).median_s();
    }
    EXPECT_EQ(allocations, before);
    EXPECT_GT(sum, 0);
}

TEST(Allocation, ComparingMotionsAllocatesNothing) {
    KnownMotion motion(model_of_random_weights(PathModel::kMostHidden, 1), -Eigen::Vector3d::UnitZ());
    const long before = allocations;
    for (int i = 0; i < 500; ++i)
        motion.push({i * (i < 250 ? 0.008 : 0.001), {0, 1 + 0.1 * std::sin(i * 0.1), 0}});
    EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace tracking
