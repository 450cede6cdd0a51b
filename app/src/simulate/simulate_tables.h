#pragma once
#include <sim/world.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "scene/scene.h"

namespace app {

/// A CSV file that grows while a simulation runs. Throws std::runtime_error when it cannot be written.
class GrowingTable {
public:
    GrowingTable(const std::filesystem::path& file, const std::string& header);
    void add(const std::string& rows);
    void finish();

private:
    void check() const;

    std::filesystem::path file_;
    std::ofstream out_;
};

[[nodiscard]] const std::string& name_of(const Scene& scene, std::size_t body);

// states.csv: a body a row at each frame's time; `modes`: its modal coordinates, separated by blanks.
[[nodiscard]] std::string states_header();
[[nodiscard]] std::string state_rows(const Scene& scene, const sim::World& world, std::size_t frame);

// energy.csv: the world before the first step and after each.
[[nodiscard]] std::string energy_header();
/// `stepped`: in this process, so that the world knows its contacts; else their cells are empty.
[[nodiscard]] std::string energy_row(const sim::World& world, bool stepped);

// times.csv: what each step took.
[[nodiscard]] std::string times_header();
[[nodiscard]] std::string times_row(std::uint64_t step, double elapsed_s);

}  // namespace app
