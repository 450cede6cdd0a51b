#include "report/json_document.h"

#include <nlohmann/json.hpp>

namespace app {

std::string json_document(const nlohmann::ordered_json& json) {
    return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace app
