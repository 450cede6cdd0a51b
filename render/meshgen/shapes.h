#pragma once
#include "obj_mesh.h"

namespace meshgen {

// Instruments, in units of their body's semi-axes: all inside [-1, 1]^3, +y up.

[[nodiscard]] ObjMesh drum();    ///< parts shell, head, hoop, lug; heads at y = +-0.985, hoops to +-1
[[nodiscard]] ObjMesh cymbal();  ///< part bronze: bowed disc of radius 1 with a bell dome
[[nodiscard]] ObjMesh bell();    ///< part metal: dome open downwards, loop and clapper
[[nodiscard]] ObjMesh bar();     ///< part bar: box with edges rounded like a superquadric of exponents 0.1
[[nodiscard]] ObjMesh string();  ///< part string: cylinder along x, radius 1 in y and z
[[nodiscard]] ObjMesh string_frame();  ///< part wood: sound board with two bridges at x = +-0.9

// Hardware.

[[nodiscard]] ObjMesh stand();  ///< parts metal, rubber; top at the origin, feet at y = -1 and radius 0.25
[[nodiscard]] ObjMesh
stick();  ///< metres; parts wood, tip: hand end (0, 0, 0.06), bead of radius 0.006 about (0, 0, -0.40)
[[nodiscard]] ObjMesh mallet();  ///< metres; parts wood, tip: the same with a felt ball of radius 0.02

/// All of them, in the order of this list; file names are their names.
[[nodiscard]] std::vector<ObjMesh> all_shapes();

}  // namespace meshgen
