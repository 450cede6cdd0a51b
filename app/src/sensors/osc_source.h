#pragma once
#include <cstddef>
#include <span>

#include "sensors/sample_source.h"

namespace app {

/// Poses from Open Sound Control messages over UDP (liblo).
///
///   address     /musicworld/stick/NAME or /NAME
///   arguments   px py pz, or px py pz qw qx qy qz: floats or doubles, metres, y up, body to world
///               before them, if the source has a clock: its time as a double [s] or as a time tag
///
/// Without a time argument the time tag of the bundle counts, if it has one; else the time of arrival.
class OscSource final : public LiveSource {
public:
    /// Throws BadInput for what is no port, std::runtime_error for one that is taken.
    OscSource(const std::string& port, const SourceOptions& options);
    ~OscSource() override;

    /// Takes the bytes of a datagram as if they had arrived.
    void datagram(std::span<const char> bytes);

protected:
    void receive(std::int64_t deadline_ns) override;

private:
    void* server_;  // lo_server
};

/// Throws BadInput for what is no port.
void check_osc_port(const std::string& port);

}  // namespace app
