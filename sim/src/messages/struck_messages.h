#pragma once
#include <cstdint>
#include <vector>

#include "struck/stepped_body.h"

namespace sim {

// Messages between a play and the workers that simulate its struck bodies; their envelope is that of worker_messages.h.
//
//   22 assign     app     u32 epoch, list of {definition, record, u8 stepped, f64 t_s}
//   23 step       app     u32 epoch, u64 step, list of u32 body, request
//   24 answer     worker  u32 epoch, u64 step, list of {record, lists of picture, f64 clearance, contact}
//
//   record           120 bytes: u32 body, u32 epoch, f64 q[6], f64 q_dot[6], f64 swing, f64 swing_dot
//   picture          112 bytes: a record's doubles
//   definition       text name, f64 a b c e1 e2, f64 young poisson density,
//                    flag visual, f64 frequency displacement decay, flag hinged, v3 pivot, v3 axis,
//                    f64 frequency damping, f64 rotation[9] by columns, v3 translation, f64 mass restitution,
//                    list of zone {text name, f64 min radius, max radius, min height, max height}
//   request          f64 t_s, flag anew, lists of impulse (folded), impulse (confirmed), path, wanted
//   impulse          60 bytes: u32 body, f64 t_s, v3 point, v3 impulse
//   path             u32 stick, f64 tip radius, list of node {f64 t_s, v3 position, v3 velocity}
//   wanted           f64 t_s, list of {impulse, f64 weight}; states for a picture
//   contact          133 bytes: u32 path, u32 stick, f64 t_s, flag starts inside, f64 depth, f64 speed,
//                    i32 zone, v3 point_world, v3 normal_world, v3 point_body, v3 impulse_body

struct StruckAssignment {
    std::uint32_t body;
    BodyDefinition definition;
    BodyRecord record;
};
struct StruckAssign {
    std::uint32_t epoch = 0;
    std::vector<StruckAssignment> bodies;  ///< none: the worker has a place
};
struct StruckStep {
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;
    std::vector<std::uint32_t> bodies;
    StepRequest request;
};
struct StruckAnswer {
    std::uint32_t epoch = 0;
    std::uint64_t step = 0;
    std::vector<BodyOutcome> outcomes;
};

}  // namespace sim
