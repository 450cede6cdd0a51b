#pragma once
#include "body/moving_body.h"

namespace sim {

/// Throw std::invalid_argument: who, what was found, what was expected.
void check_world(const WorldDefinition& definition);
void check_world_body(const WorldBody& body);
void check_constraint(const PointConstraint& constraint, int bodies);
void check_state(const WorldBodyState& state, int modes, bool fixed);

/// Names the first value of state or forces that is not finite, or is beyond 1e7 m, 1e6 m/s or 1e6 rad/s;
/// empty: none.
[[nodiscard]] std::string what_is_broken(const MovingBody& body);

}  // namespace sim
