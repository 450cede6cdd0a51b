#include "tracking/newest_value.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <thread>

#include "tracking/stick_state.h"

namespace tracking {
namespace {

using std::chrono::steady_clock;

/// As many words as a StickState, all derived from one number.
struct Payload {
    std::array<std::uint64_t, sizeof(StickState) / sizeof(std::uint64_t)> words{};
};

std::uint64_t word_of(std::uint64_t number, std::size_t i) {
    return (number + i) * 0x9e3779b97f4a7c15U;  // odd: distinct numbers have distinct words
}

Payload payload(std::uint64_t number) {
    Payload value;
    value.words[0] = number;
    for (std::size_t i = 1; i < value.words.size(); ++i) value.words[i] = word_of(number, i);
    return value;
}

bool is_whole(const Payload& value) {
    std::uint64_t differences = 0;
    for (std::size_t i = 1; i < value.words.size(); ++i)
        differences |= value.words[i] ^ word_of(value.words[0], i);
    return differences == 0;
}

using Newest = NewestValue<Payload>;

/// Memory that child processes share, zero at first.
class SharedMemory {
public:
    SharedMemory()
        : memory_(mmap(nullptr, sizeof(Newest), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0)) {}
    ~SharedMemory() { munmap(memory_, sizeof(Newest)); }
    SharedMemory(const SharedMemory&) = delete;
    SharedMemory& operator=(const SharedMemory&) = delete;
    [[nodiscard]] Newest& newest() const { return Newest::at(memory_); }

private:
    void* memory_;
};

bool is_long() {
    return std::getenv("MUSICWORLD_LONG") != nullptr;
}

/// What a reader saw, reading again and again.
struct Reads {
    std::int64_t count = 0, none = 0, torn = 0, backwards = 0, values = 0;
    std::uint64_t last = 0;

    void read(const Newest& newest) {
        ++count;
        const std::optional<Payload> value = newest.read();
        if (!value) {
            ++none;
            return;
        }
        torn += !is_whole(*value);
        backwards += value->words[0] < last;
        values += value->words[0] != last;
        last = value->words[0];
    }
};

/// Publishes 1, 2, ... until the thread is told to stop; `period` zero: as fast as it can.
std::jthread writer(Newest& newest, std::chrono::microseconds period) {
    return std::jthread([&newest, period](const std::stop_token& stop) {
        auto due = steady_clock::now();
        for (std::uint64_t number = 1; !stop.stop_requested(); ++number) {
            newest.publish(payload(number));
            if (period.count() > 0) std::this_thread::sleep_until(due += period);
        }
    });
}

void print(const char* what, const Reads& reads, steady_clock::time_point begin) {
    const std::chrono::duration<double> wall = steady_clock::now() - begin;
    std::printf(
        "%s: %.3g reads in %.1f s (%.0f ns each): %lld values, torn=%lld, backwards=%lld, none=%lld\n", what,
        static_cast<double>(reads.count), wall.count(), wall.count() * 1e9 / static_cast<double>(reads.count),
        static_cast<long long>(reads.values), static_cast<long long>(reads.torn),
        static_cast<long long>(reads.backwards), static_cast<long long>(reads.none));
}

/// 1e7 reads, 1e9 in the long run, against a writer in another thread.
Reads read_while_writing(const char* what, std::chrono::microseconds period) {
    const SharedMemory memory;
    const auto begin = steady_clock::now();
    const std::jthread thread = writer(memory.newest(), period);
    while (!memory.newest().read()) sched_yield();
    Reads reads;
#ifdef MUSICWORLD_SANITIZED
    constexpr std::int64_t kShort = 500'000;  // some twenty seconds
#else
    constexpr std::int64_t kShort = 10'000'000;
#endif
    const std::int64_t count = is_long() ? 1'000'000'000 : kShort;
    while (reads.count < count) reads.read(memory.newest());
    print(what, reads, begin);
    EXPECT_EQ(reads.torn, 0);
    EXPECT_EQ(reads.backwards, 0);
    EXPECT_GT(reads.values, 10);
    return reads;
}

TEST(NewestValue, HasNoneBeforeTheFirstPublication) {
    const SharedMemory memory;
    EXPECT_FALSE(memory.newest().read());
    memory.newest().publish(payload(5));
    EXPECT_EQ(memory.newest().read()->words, payload(5).words);
}

TEST(NewestValue, IsTheLastPublishedOne) {
    const SharedMemory memory;
    for (std::uint64_t number = 1; number <= 1000; ++number) {
        memory.newest().publish(payload(number));
        ASSERT_EQ(memory.newest().read()->words, payload(number).words);
    }
    EXPECT_EQ(memory.newest().published(), 1000U);
}

TEST(NewestValue, CarriesAStickState) {
    const auto newest = std::make_unique<NewestValue<StickState>>();
    StickState state;
    state.samples = 7;
    state.due_ns = -3;
    state.position = Eigen::Vector3d(1, 2, 3);
    Motion turned;
    turned.orientation = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5);
    state.picture = turned;
    SampledMotion sampled(0.1, 1);
    PosePrediction last;
    last.position = Eigen::Vector3d(4, 5, 6);
    sampled.set(1, last);
    state.sound = sampled;
    state.confirming.law = MotionLaw::decaying_acceleration;
    state.confirming.rate = 3;
    newest->publish(state);
    const StickState read = *newest->read();
    EXPECT_EQ(read.samples, 7U);
    EXPECT_EQ(read.due_ns, -3);
    EXPECT_EQ(read.position, state.position);
    ASSERT_TRUE(read.picture.motion());
    EXPECT_EQ(read.picture.motion()->orientation.coeffs(), turned.orientation.coeffs());
    EXPECT_FALSE(read.sound.motion());
    EXPECT_EQ(read.sound.after(0.1).position, last.position);
    EXPECT_EQ(read.confirming.law, MotionLaw::decaying_acceleration);
    EXPECT_EQ(read.confirming.rate, 3);
}

TEST(NewestValue, IsNeverTornWhileAThreadPublishesAsFastAsItCan) {
    const Reads reads = read_while_writing("writer at full speed", std::chrono::microseconds(0));
    // A writer that publishes three values within each copy leaves none whole; here one in 1e4 such reads.
    EXPECT_LT(reads.none, reads.count / 20);
}

TEST(NewestValue, IsNeverTornWhileAThreadPublishesAt1kHz) {
    const Reads reads = read_while_writing("writer at 1 kHz", std::chrono::microseconds(1000));
    EXPECT_EQ(reads.none, 0);
}

/// A process that goes on publishing where the last one stopped, until it is killed.
pid_t fork_writer(Newest& newest) {
    const pid_t child = fork();
    if (child != 0) return child;
    const std::optional<Payload> last = newest.read();
    for (std::uint64_t number = last ? last->words[0] + 1 : 1;; ++number) newest.publish(payload(number));
}

/// Writers publish at full speed and are killed at random moments, mostly in mid-write, since they do nothing
/// else; the next one goes on. The reader reads all the time, also between the death of one and the birth of
/// the next. 1000 writers in the long run.
TEST(NewestValue, SurvivesWritersKilledAtRandomMoments) {
    const SharedMemory memory;
    Newest& newest = memory.newest();
    newest.publish(payload(1));
    const int writers = is_long() ? 1000 : 100;
    std::mt19937 random(3);
    std::uniform_int_distribution<int> microseconds(0, 4000);
    Reads reads;
    const auto begin = steady_clock::now();
    for (int i = 0; i < writers; ++i) {
        const std::uint64_t before = newest.published();
        const pid_t child = fork_writer(newest);
        ASSERT_GT(child, 0);
        while (newest.published() == before) reads.read(newest);
        const auto end = steady_clock::now() + std::chrono::microseconds(microseconds(random));
        while (steady_clock::now() < end) reads.read(newest);
        kill(child, SIGKILL);
        for (int k = 0; k < 100; ++k) reads.read(newest);
        ASSERT_EQ(waitpid(child, nullptr, 0), child);
        const std::uint64_t last = newest.published();
        reads.read(newest);
        ASSERT_EQ(reads.last, last) << "the newest complete value of a dead writer";
    }
    std::printf("%d writers killed; ", writers);
    print("their reader", reads, begin);
    EXPECT_EQ(reads.torn, 0);
    EXPECT_EQ(reads.backwards, 0);
    EXPECT_LT(reads.none, reads.count / 20);  // as above
    EXPECT_GE(reads.values, writers);
}

}  // namespace
}  // namespace tracking
