#pragma once
#include <chrono>
#include <vector>

#include "workers/worker_gate.h"
#include "workers/worker_process.h"

namespace sim {

/// Bodies shared out to worker processes, which join through a WorkerGate. Their messages are handled in the
/// constructor, step() and the destructor.
///
/// The application holds every body's definition and its record after the last answer. A worker is killed if
/// it exits, does not join in time, is silent for 1 s, breaks the protocol or does not answer within 30 s.
/// Its bodies are assigned, from these records, to the other workers in turn, or to this process when none is
/// left. The step is requested again for those of its bodies that were not answered. Records are exact, each
/// body's step depends on nothing else, and merge() orders by body. So the reply has the same bits in every
/// case. Every assignment has a new epoch. An answer counts only if its worker lives and got a request for
/// that step under that epoch. Wall time decides only which process computes.
class StruckWorkers final : public Simulation {
public:
    StruckWorkers(std::vector<BodyDefinition> bodies, const WorkerLaunch& launch);
    ~StruckWorkers() override;

    StepReply step(const StepRequest& request) override;
    WorkerReport report() const override { return report_; }

private:
    using Clock = std::chrono::steady_clock;
    struct Pending {
        std::uint32_t epoch;
        std::vector<std::uint32_t> bodies;
        Clock::time_point since;
    };
    struct Slot {
        WorkerProcess process;
        bool joined = false, alive = true;
        std::vector<std::uint32_t> bodies;
        std::vector<Pending> pending;
    };

    void wait_for_joins();
    void share_out();
    void dispatch(Slot& slot, const std::vector<std::uint32_t>& bodies);
    void assign(Slot& slot, const std::vector<std::uint32_t>& bodies);
    [[nodiscard]] StepRequest request_for(const std::vector<std::uint32_t>& bodies) const;
    void send(const Slot& slot, const WorkerMessage& message);
    void receive(std::chrono::milliseconds timeout);
    void handle(const WorkerGate::Event& event);
    void join(const WorkerGate::Event& event);
    void accept(Slot& slot, StruckAnswer& answer);
    [[nodiscard]] bool answers(const Pending& pending, const StruckAnswer& answer) const;
    void check_workers();
    void lose(Slot& slot);
    void reassign_orphans();
    void take_over(const std::vector<std::uint32_t>& bodies);
    void step_here(std::uint32_t body);
    [[nodiscard]] bool waiting() const;

    std::vector<BodyDefinition> definitions_;
    std::vector<BodyRecord> records_;
    std::vector<BodyOutcome> outcomes_;
    std::vector<std::uint64_t> answered_;             ///< per body: number of the last step it has made
    std::vector<std::unique_ptr<SteppedBody>> here_;  ///< bodies stepped in this process
    std::vector<std::uint32_t> orphans_;              ///< bodies of workers just lost
    const std::chrono::duration<double> join_within_;
    const StepRequest* request_ = nullptr;  ///< of the step under way
    std::uint64_t step_ = 0;
    double last_t_s_ = 0;
    std::uint32_t epoch_ = 0;
    std::size_t next_slot_ = 0;
    Clock::time_point checked_;
    WorkerReport report_;
    WorkerGate gate_;
    std::vector<Slot> slots_;  ///< by members' numbers; last member: the processes end before the gate
};

}  // namespace sim
