#include "bench/machine_speed.h"

#include <immintrin.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <fstream>
#include <functional>
#include <thread>
#include <vector>

#include "process/clock.h"

namespace app {
namespace {

#ifdef __FMA__
using Vector = __m256;
constexpr int kLanes = 8;
Vector all(float value) {
    return _mm256_set1_ps(value);
}
Vector multiply_add(Vector a, Vector b, Vector c) {
    return _mm256_fmadd_ps(a, b, c);
}
Vector load(const float* from) {
    return _mm256_loadu_ps(from);
}
#else
using Vector = __m128;
constexpr int kLanes = 4;
Vector all(float value) {
    return _mm_set1_ps(value);
}
Vector multiply_add(Vector a, Vector b, Vector c) {
    return _mm_add_ps(_mm_mul_ps(a, b), c);
}
Vector load(const float* from) {
    return _mm_loadu_ps(from);
}
#endif

constexpr int kChains = 12;  // independent, so that no operation waits for the one before it

struct Chains {
    Vector chain[kChains];
};

float sum_of(const Chains& chains) {
    float sum = 0;
    for (const Vector& v : chains.chain) {
        alignas(32) std::array<float, kLanes> lanes{};
        std::copy_n(reinterpret_cast<const float*>(&v), kLanes, lanes.begin());
        for (const float x : lanes) sum += x;
    }
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
    for (int i = 0; i < kChains; ++i) chains.chain[i] = all(0.1f * static_cast<float>(i));
    const Vector a = all(0.999f), b = all(0.001f);
    for (int round = 0; round < rounds; ++round)
        for (Vector& v : chains.chain) v = multiply_add(v, a, b);
    return sum_of(chains);
}

float read_all(const std::vector<float>& numbers) {
    Chains chains;
    for (Vector& v : chains.chain) v = all(0);
    const Vector one = all(1);
    constexpr std::size_t kStride = kChains * kLanes;
    for (std::size_t i = 0; i + kStride <= numbers.size(); i += kStride)
        for (std::size_t k = 0; k < kChains; ++k)
            chains.chain[k] = multiply_add(load(&numbers[i + k * kLanes]), one, chains.chain[k]);
    return sum_of(chains);
}

}  // namespace

MachineSpeed measure_machine_speed() {
    constexpr int kRounds = 2'000'000;
    const std::vector<float> numbers(std::size_t{64} << 20, 1.0f);  // 256 MiB
    return {
        best_rate(2.0 * kChains * kLanes * kRounds, [] { return multiply_adds(kRounds); }),
        best_rate(static_cast<double>(numbers.size() * sizeof(float)), [&] { return read_all(numbers); })};
}

MachineName machine_name() {
    MachineName name;
    name.cores = std::thread::hardware_concurrency();
    name.compiler = "gcc " __VERSION__;
#ifndef __AVX2__
    name.avx2 = false;
#endif
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);) {
        const std::size_t colon = line.find(": ");
        if (line.rfind("model name", 0) == 0 && colon != std::string::npos) {
            name.processor = line.substr(colon + 2);
            break;
        }
    }
    return name;
}

}  // namespace app
