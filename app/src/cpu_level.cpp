// Compiled for every x86-64 and run before anything that needs more: a clear message instead of an illegal
// instruction.
#include <unistd.h>

#include <cstdlib>

namespace {

__attribute__((constructor(101))) void check_cpu_level() {
#ifndef MUSICWORLD_BASELINE
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") && __builtin_cpu_supports("bmi2"))
        return;
    constexpr char message[] =
        "musicworld: error: found a processor without AVX2, FMA and BMI2, expected x86-64-v3; "
        "configure with -DMUSICWORLD_BASELINE=ON for older ones\n";
    (void)!write(STDERR_FILENO, message, sizeof message - 1);
    _exit(2);
#endif
}

}  // namespace
