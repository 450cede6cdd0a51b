#pragma once
#include <sim/accuracy.h>

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace app {

/// The accuracy that was asked of a run, and what is estimated of it.
struct KeptAccuracy {
    sim::AccuracyReport report;
    std::vector<std::string> names;  ///< of the bodies

    [[nodiscard]] bool is_kept() const;
    /// Asked, estimated and where most of it comes from; what is not kept, and from when.
    [[nodiscard]] std::vector<std::string> lines() const;
    [[nodiscard]] nlohmann::ordered_json json() const;  ///< of all, and the parts of the worst bodies

private:
    [[nodiscard]] std::vector<std::size_t> worst_first() const;
};

}  // namespace app
