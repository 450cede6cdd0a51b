#pragma once
#include <tracking/import.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "files/assets.h"
#include "files/format_description.h"

namespace app {

/// A map by path, or by the name of a bundled one ("optitrack" is assets/maps/optitrack.toml), or spelt out:
/// "t=Time,px=X,py=Y,pz=Z". Throws BadInput with its place.
[[nodiscard]] tracking::ColumnMap find_map(const std::string& map);

/// A map file (TOML). Throws BadInput with FILE:LINE:COLUMN for whatever is unknown or wrong.
[[nodiscard]] tracking::ColumnMap read_map(const std::filesystem::path& file);
/// Its text; reads back to the same map.
[[nodiscard]] std::string format_map(const tracking::ColumnMap& map);

/// Keys, ranges and defaults of map files.
[[nodiscard]] FormatDescription map_format();

/// The bundled map for a file that begins so; none if it has none of their signatures.
[[nodiscard]] std::optional<tracking::ColumnMap> map_for(std::string_view text);
/// Names of the bundled maps.
[[nodiscard]] inline std::vector<std::string> map_names() {
    return bundled_names("maps");
}

}  // namespace app
