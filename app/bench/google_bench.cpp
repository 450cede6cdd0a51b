#include "bench/google_bench.h"

#include <fmt/format.h>

#include <array>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "process/child_process.h"

namespace app {
namespace {

/// What a program writes to its standard output, to its end.
std::string output_of(const std::vector<std::string>& command) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    if (!file) throw std::runtime_error("error: cannot make a temporary file");
    if (const int status = wait_for_child(start_child({command, {}, -1, fileno(file.get()), -1}));
        status != 0)
        throw std::runtime_error(fmt::format("error: {} ended with status {}", command[0], status));
    std::rewind(file.get());
    std::string text;
    std::array<char, 65536> part;
    while (const std::size_t size = std::fread(part.data(), 1, part.size(), file.get()))
        text.append(part.data(), size);
    return text;
}

}  // namespace

std::vector<BenchResult> read_google_benchmark(const std::string& text) {
    std::vector<BenchResult> results;
    try {
        for (const nlohmann::json& one : nlohmann::json::parse(text).at("benchmarks"))
            results.push_back({one.at("name"), one.at("cpu_time"), one.at("time_unit")});
    } catch (const nlohmann::json::exception& wrong) {
        throw std::runtime_error(
            fmt::format("error: a benchmark's output is not understood: {}", wrong.what()));
    }
    return results;
}

BenchReport run_bench_program(const std::string& name) {
    const std::filesystem::path program = program_beside(name);
    if (!std::filesystem::exists(program))
        throw std::runtime_error(fmt::format(
            "error: cannot find {}; cmake --build BUILD --target {} builds it", program.string(), name));
    BenchReport report;
    report.machine = machine_name();
    report.results = read_google_benchmark(output_of({program.string(), "--benchmark_format=json"}));
    report.notes.push_back(name + ": processor time.");
    return report;
}

}  // namespace app
