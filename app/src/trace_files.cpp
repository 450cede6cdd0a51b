#include "trace_files.h"

#include "kit.h"

namespace app {

std::filesystem::path find_trace(const std::string& name_or_path) {
    std::filesystem::path bundled = assets_folder() / "traces" / (name_or_path + ".csv");
    const bool name = name_or_path.find('/') == std::string::npos;
    std::error_code ignored;
    if (name && !std::filesystem::exists(name_or_path, ignored) &&
        std::filesystem::is_regular_file(bundled, ignored))
        return bundled;
    return name_or_path;
}

}  // namespace app
