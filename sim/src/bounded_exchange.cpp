// Stands in until the bounded exchange is there.
#include <stdexcept>

#include "exchange.h"

namespace sim {
std::unique_ptr<Exchange> make_bounded_exchange(const SceneMessage&) {
    throw std::logic_error("no bounded exchange yet");
}
}  // namespace sim
