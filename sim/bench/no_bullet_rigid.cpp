#include "rigid_peer.h"

namespace sim_bench {

bool add_bullet(std::vector<PeerLibrary>&) {
    return false;
}

}  // namespace sim_bench
