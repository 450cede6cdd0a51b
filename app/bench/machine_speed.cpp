#include "bench/machine_speed.h"

#include <immintrin.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <vector>

#include "process/clock.h"

namespace app {
namespace {

#ifdef __FMA__
using Vector = __m256;
Vector multiply_add(Vector a, Vector b, Vector c) {
    return _mm256_fmadd_ps(a, b, c);
}
#else
using Vector = __m128;
Vector multiply_add(Vector a, Vector b, Vector c) {
    return a * b + c;
}
#endif

constexpr std::size_t kLanes = sizeof(Vector) / sizeof(float);
constexpr std::size_t kChains = 12;  // independent, so that no operation waits for the one before it

struct Chains {
    Vector chain[kChains] = {};
};

float sum_of(const Chains& chains) {
    float sum = 0;
    for (const Vector& v : chains.chain)
        for (std::size_t lane = 0; lane < kLanes; ++lane) sum += v[lane];
    return sum;
}

// Best of several short runs: others' load only ever slows down.
double best_rate(double work, const std::function<float()>& run) {
    double best = 0;
    volatile float kept = 0;
    for (int i = 0; i < 5; ++i) {
        const double begin = thread_cpu_s();
        kept = kept + run();
        best = std::max(best, work / (thread_cpu_s() - begin));
    }
    return best;
}

float multiply_adds(int rounds) {
    Chains chains;
    for (std::size_t i = 0; i < kChains; ++i) chains.chain[i] += 0.1f * static_cast<float>(i);
    const Vector a = Vector{} + 0.999f, b = Vector{} + 0.001f;
    for (int round = 0; round < rounds; ++round)
        for (Vector& v : chains.chain) v = multiply_add(v, a, b);
    return sum_of(chains);
}

float read_all(const std::vector<float>& numbers) {
    Chains chains;
    const Vector one = Vector{} + 1;
    constexpr std::size_t kStride = kChains * kLanes;
    for (std::size_t i = 0; i + kStride <= numbers.size(); i += kStride)
        for (std::size_t k = 0; k < kChains; ++k) {
            Vector read;
            std::memcpy(&read, &numbers[i + k * kLanes], sizeof read);
            chains.chain[k] = multiply_add(read, one, chains.chain[k]);
        }
    return sum_of(chains);
}

}  // namespace

MachineSpeed measure_machine_speed() {
    constexpr int kRounds = 2'000'000;
    const std::vector<float> numbers(std::size_t{64} << 20, 1.0f);  // 256 MiB
    return {
        best_rate(2.0 * static_cast<double>(kChains * kLanes) * kRounds,
                  [] { return multiply_adds(kRounds); }),
        best_rate(static_cast<double>(numbers.size() * sizeof(float)), [&] { return read_all(numbers); })};
}

}  // namespace app
