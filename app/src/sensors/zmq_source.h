#pragma once
#include <memory>

#include "sensors/live_intake.h"

namespace app {

/// Native rows from a ZeroMQ publisher: a SUB socket that connects and subscribes to everything. The last
/// part of each message is one row or several, with or without a head (RowDecoder); messages of more than 64
/// KiB are refused by the socket. It never ends; a publisher that comes later or again is found.
class ZmqSource final : public SampleSource {
public:
    /// Throws BadInput for what is no endpoint.
    ZmqSource(const std::string& endpoint, const SourceOptions& options);
    ~ZmqSource() override;

    [[nodiscard]] SourceStatus next(SourceSample& sample, std::int64_t deadline_ns) override;
    [[nodiscard]] const StickNames& sticks() const override;
    [[nodiscard]] SourceHead head() const override;
    [[nodiscard]] SourceFaults faults() const override;
    [[nodiscard]] std::string stream_head() const override;

private:
    struct Connection;
    std::unique_ptr<Connection> connection_;
};

}  // namespace app
