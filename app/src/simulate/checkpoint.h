#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "simulate/run_measures.h"

namespace app {

/// How far the outputs of a run are, and what they will say of the steps that have been done.
struct RecordState {
    std::array<std::uint64_t, 3> table_bytes{};  ///< of states.csv, energy.csv, times.csv
    std::uint64_t next_frame = 0, body_steps = 0;
    MomentumWatch::Largest momentum;
    std::vector<std::pair<int, std::uint64_t>> spun;  ///< bodies, and the step that was reported
    double wall_s = 0;
};

/// What `simulate --checkpoint` saves, and `--resume` goes on from: a file of its own, with a checksum.
struct Checkpoint {
    std::vector<std::string> words;   ///< of the command `simulate` that began the run
    std::filesystem::path directory;  ///< in which names of files begin there
    std::string version, build;       ///< of the program
    std::string scene_sha256;         ///< of the scene's file
    RecordState record;
    std::vector<std::uint8_t> state;  ///< sim::encode(RunState)
};

/// What must be the same where a run goes on: to the bit only this build on such a processor does.
[[nodiscard]] std::string program_build();

/// Where a folder's unfinished run keeps it.
[[nodiscard]] std::filesystem::path checkpoint_file(const std::filesystem::path& out);

/// The bytes of the file; see checkpoint.cpp.
[[nodiscard]] std::vector<std::uint8_t> format_checkpoint(const Checkpoint& checkpoint);

/// Throws BadInput, with the file's name, for one that is not there, is damaged or of another version's.
[[nodiscard]] Checkpoint read_checkpoint(const std::filesystem::path& file);

}  // namespace app
