#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <vector>

#include "messages/worker_messages.h"
#include "shared/columns.h"

namespace sim {

/// One worker's load balancing: a market without a planner (thesis 2.4). A worker that needs more time per
/// step than the average offers border columns to its fastest neighbour, by the workers' own reports.
///
///   W^i T^i = (T^i - T^avg) / S     (2.32)
///   T^i  seconds that worker i works per step, without waiting: its work by World::work, smoothed over few
///        steps, times its seconds per work, smoothed over many
///   S    sellers: workers above the average that may sell to the same buyer; N - 2 at most in the thesis,
///        which knows no neighbours
///   W^i T^i  seconds to offer. The part that is less than a whole column is carried to the next offer.
///
/// Neighbours have bodies in the same or touching columns. A worker that owns nothing is everybody's
/// neighbour. If no neighbour, direct or through others, is below the average, all workers count as
/// neighbours. Columns are sold that make the border to the buyer shorter, or longer by the least.
///
/// Departures from the thesis:
/// - An offer makes the buyer slower than the slower of the seller and the average by no more than the dead
///   band. A buyer that would become slower declines, unless the application asked for the sale (Gather).
/// - Sold work counts for the buyer at once. Reports from before the registration (older epoch) are ignored:
///   they would sell the same work twice.
/// - A worker sells at any step while another one owns nothing, or once it has been far above the average for
///   some steps, until it is near it.
/// - Otherwise the workers above the average take turns of 25 steps (more for bounds above 24), the slowest
///   first. In its turn a worker sells one column, or several if it was above the average when each of the
///   two turns before began. Whose turn it is follows from all reports of the step in which the turn before
///   began. Every worker has these by then.
/// - Columns that have settled among another worker's are returned to it although times are level, if the
///   border becomes shorter and the other one stays level. For this, workers take every fourth turn, and all
///   turns in which nobody has to sell.
class Market {
public:
    /// `bound`: of the run, how many steps others may be ahead or behind.
    Market(std::uint32_t self, const MarketSettings& settings, int bound);

    void set_members(const std::vector<std::uint32_t>& workers);
    /// Takes another worker's report of its step: the seconds of a step, the number of its bodies.
    void receive_report(const MessageHeader& header, double smoothed_s, std::uint32_t own);
    void register_sale(std::uint32_t epoch, const Ownership& ownership);
    /// Takes this worker's step `step`: its seconds, its work (World::work), the number of own bodies.
    void end_step(std::uint64_t step, double seconds, double work, int own);

    // Selling: one offer at a time, until it is declined or handed over.
    [[nodiscard]] bool wants_to_sell() const;
    /// An offer of some of this worker's lots; none if no lot fits.
    [[nodiscard]] std::optional<Offer> make_offer(Holdings holdings);
    /// An offer of the own bodies that the application asked for, at any cost.
    [[nodiscard]] std::optional<Offer> make_offer(const Gather& request);
    [[nodiscard]] bool is_selling() const { return sale_ != Sale::none; }  ///< an offer is under way
    /// The offer was accepted; its bodies are not handed over yet.
    [[nodiscard]] bool is_sold() const { return sale_ == Sale::accepted; }
    /// Bodies were handed over; their registration has not come yet.
    [[nodiscard]] bool awaits_registration() const { return handed_over_.has_value(); }
    /// The next step has to wait for the answer to an offer, because the buyer or another worker owns
    /// nothing. So work is level after few steps, however long messages take. A worker that has just joined
    /// is not waited for: it may still be building its world.
    [[nodiscard]] bool awaits_answer() const {
        return fills_idle_ && sale_ == Sale::offered && patient_ && workers_.at(offer_.to).answers;
    }
    void stop_waiting() { patient_ = false; }  ///< for the answer to the offer that is under way
    /// Takes an answer; returns whether it accepts the offer that is under way.
    bool receive_answer(std::uint32_t worker, const OfferAnswer& answer);
    /// The offer that was accepted, if there is one. From here on it counts as handed over.
    [[nodiscard]] std::optional<Offer> hand_over();

    // Buying.
    [[nodiscard]] OfferAnswer answer(std::uint32_t seller, const Offer& offer);

    [[nodiscard]] double smoothed() const { return workers_.at(self_).smoothed; }  ///< own seconds per step

private:
    struct Worker {
        double smoothed = 0;      // seconds per step
        int own = 0;              // bodies
        std::uint32_t epoch = 0;  // older reports do not count
        bool answers = false;     // it was a member at first, or has sent something since it joined
        struct Mark {
            std::uint64_t step = 0;
            double smoothed = 0;
        };
        std::array<Mark, 3> marks = {};  // its reports of the steps in which the last three turns began
    };
    enum class Turn { none, sale, homing };
    enum class Sale { none, offered, accepted };
    using Neighbours = std::map<std::uint32_t, std::set<std::uint32_t>>;

    [[nodiscard]] double average() const;
    [[nodiscard]] bool is_above(const Worker& worker) const;
    void mark(Worker& worker, std::uint64_t step, double smoothed) const;
    void begin_turn();
    [[nodiscard]] bool wants_less() const;
    void watch_level();
    void judge_trial();
    [[nodiscard]] std::uint32_t buyer(const Neighbours& neighbours) const;
    [[nodiscard]] bool has_faster_neighbour(std::uint32_t worker, const Neighbours& neighbours) const;
    [[nodiscard]] int sellers(std::uint32_t buyer, const Neighbours& neighbours) const;
    void sell(Holdings& holdings, const Neighbours& neighbours);
    void return_settled(Holdings& holdings, const Neighbours& neighbours);
    void add_to_offer(Holdings& holdings, std::size_t lot);
    void add_load(Worker& worker, int bodies, double cost);

    std::uint32_t self_;
    MarketSettings settings_;
    std::map<std::uint32_t, Worker> workers_;  // members, with this one
    std::uint64_t turn_steps_;                 // from turn to turn
    std::uint64_t step_ = 0, not_before_ = 0;
    Turn turn_ = Turn::none;  // this worker's in this step
    double lasting_ =
        0;             // share of the average by which it was above it when both turns before this one began
    double work_ = 0;  // own work of a step, smoothed over few steps
    double many_seconds_ = 0, many_work_ = 0;  // of a step, smoothed over many steps
    double steps_known_ = 0;                   // of these
    bool free_ = false;                        // this worker may sell out of turn
    bool fills_idle_ = false;                  // likewise, because another worker owned nothing
    int far_steps_ = 0;                        // steps in a row in which it was far above the average
    /// What was sold since this worker began to sell out of turn, and whether that helps.
    struct Trial {
        std::uint64_t judged_at = 0;  // 0: there is no trial
        double most = 0, sold = 0;    // [s]
        double expected = 0;          // own seconds per step after it
    };
    Trial trial_;
    std::uint64_t patience_ = 0;  // steps without a sale after a trial that does not help
    double carried_ = 0;          // [s] to be sold with a later offer
    Sale sale_ = Sale::none;
    Offer offer_;
    double offer_cost_ = 0;              // [s] here
    std::optional<double> handed_over_;  // cost of bodies whose registration has not come [s]
    std::uint32_t next_number_ = 0;
    bool patient_ = true;  // see stop_waiting
    /// By seller, in the order of its offers: costs here of what was accepted and is not registered yet [s].
    std::map<std::uint32_t, std::deque<double>> promises_;
};

}  // namespace sim
