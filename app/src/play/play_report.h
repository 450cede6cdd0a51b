#pragma once
#include <filesystem>
#include <string>

#include "play/play_result.h"

namespace app {

/// Text of report.html: what was played, key figures, pictures, plots and tables on one page that needs
/// nothing beside it: no script, no font, no address; pictures and plots lie within. Light and dark follow
/// the reader's system. All names are escaped. The frames of `report_frames` are read from disk, plots are
/// drawn by gnuplot with temporary files in `scratch` (an existing folder). A pure function of the result
/// without its times and workers, of the frames and of gnuplot's version. Throws std::runtime_error without
/// gnuplot or without a frame.
[[nodiscard]] std::string format_report(const PlayResult& result, const std::filesystem::path& scratch);

}  // namespace app
