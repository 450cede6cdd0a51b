#pragma once
#include <string>

#include "bench/bench_report.h"

namespace app {

/// Runs a benchmark that lies beside what it measures: a program in the folder of this one which prints its
/// figures as Google Benchmark does (--benchmark_format=json). Throws std::runtime_error if it is not built
/// or fails.
[[nodiscard]] BenchReport run_bench_program(const std::string& name);

/// The figures in what such a program printed: processor time by name. Throws std::runtime_error.
[[nodiscard]] std::vector<BenchResult> read_google_benchmark(const std::string& json);

}  // namespace app
