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

/// One worker's load-balancing policy, a market without a planner (thesis 2.4): a worker that needs more time
/// per step than the average offers border columns to its fastest neighbour, by the workers' own reports.
///
///   W^i T^i = (T^i - T^avg) / S     (2.32)
///   T^i  seconds that worker i works per step (does not wait): its work, by World::work, smoothed over few
///        steps, times its seconds per work, smoothed over many
///   S    sellers: workers above the average that may sell to the same buyer; N - 2 at most in the thesis,
///        which knows no neighbours
///   W^i T^i  seconds offered; what is less than a whole column is carried to the next offer
///
/// Neighbours have bodies in the same or touching columns; who owns nothing is everybody's neighbour. Where no
/// neighbour of neighbours is below the average, everybody is one. Of the columns those are sold that make the
/// border to the buyer shorter, or longer by the least.
///
/// Departures: an offer makes the buyer slower than the slower of the seller and the average by no more than the dead band;
/// a buyer that would become slower declines (not what the application asked for, see Gather); sold work counts for the
/// buyer at once, and reports written before the registration (older epoch) are ignored, otherwise stale figures would
/// sell the same work twice. Trade is
/// free while somebody owns nothing, or once a worker has been far above the average for some steps, until it
/// is near it. Else those above the average take turns, the slowest first, every 25 steps (more only for bounds above
/// 24), and sell one column, or several if they were above it when each of the two turns before this one began. Whose turn it is
/// follows from what all reported of the step in which the turn before began, which everybody has heard by then.
///
/// Bodies that have come to lie among another worker's go home to it: lots that make the border shorter are
/// given away although times are level, if the other stays level. For this all take turns, too: every fourth turn, and
/// those in which nobody has to sell.
class Market {
public:
    /// bound: of the run, how many steps others may be ahead or behind.
    Market(std::uint32_t self, const MarketSettings& settings, int bound);

    void members(const std::vector<std::uint32_t>& workers);  ///< sets the members
    /// Takes another worker's report of its step: the seconds of a step, the number of its bodies.
    void heard(const MessageHeader& header, double smoothed_s, std::uint32_t own);
    void registered(std::uint32_t epoch, const Ownership& ownership);
    /// Takes own step `step`: its seconds, its work (World::work), the number of own bodies.
    void worked(std::uint64_t step, double seconds, double work, int own);

    // Selling: one offer at a time, until it is declined or handed over.
    [[nodiscard]] bool wants_to_sell() const;
    /// An offer of some of own lots, which are all that this worker has; none if no lot fits.
    [[nodiscard]] std::optional<Offer> make_offer(Holdings holdings);
    [[nodiscard]] bool is_selling() const { return sale_ != Sale::none; }  ///< an offer is under way
    [[nodiscard]] bool is_sold() const {
        return sale_ == Sale::accepted;
    }  ///< what was offered; it is not handed over
    [[nodiscard]] bool awaits_registration() const {
        return handed_over_.has_value();
    }  ///< of what was handed over
    /// Somebody owns nothing and was offered something: the next step is to wait for the answer, so that work is level after few
    /// steps, however long messages take. Not for that of a worker that has just joined: it may still be making its world.
    [[nodiscard]] bool awaits_answer() const {
        return spreads_ && sale_ == Sale::offered && patient_ && workers_.at(offer_.to).answers;
    }
    void stop_waiting() { patient_ = false; }  ///< for the answer to the offer that is under way
    /// An offer of these own bodies to a member, whatever they cost there.
    [[nodiscard]] std::optional<Offer> make_offer(const Gather& asked);
    /// Whether that is sold which is on offer.
    bool answered(std::uint32_t worker, const OfferAnswer& answer);
    /// The offer that was accepted, if one was; counts as handed over.
    [[nodiscard]] std::optional<Offer> hand_over();

    /// Buying.
    [[nodiscard]] OfferAnswer answer(std::uint32_t seller, const Offer& offer);

    [[nodiscard]] double smoothed() const { return workers_.at(self_).smoothed; }  ///< own seconds per step

private:
    struct Worker {
        double smoothed = 0;      // [s]
        int own = 0;              // bodies
        std::uint32_t epoch = 0;  // reports from before do not count
        bool answers = false;     // it was there at first, or was heard of since it joined
        struct Mark {
            std::uint64_t step = 0;
            double smoothed = 0;
        };
        std::array<Mark, 3> marks = {};  // of its reports, where the last three turns began
    };
    enum class Turn { none, sale, home };
    enum class Sale { none, offered, accepted };
    using Neighbours = std::map<std::uint32_t, std::set<std::uint32_t>>;

    [[nodiscard]] double average() const;
    [[nodiscard]] bool above(const Worker& worker) const;
    void mark(Worker& worker, std::uint64_t step, double smoothed) const;
    void take_turn();
    [[nodiscard]] bool wants_less() const;
    void watch_level();
    void judge();
    [[nodiscard]] std::uint32_t buyer(const Neighbours& neighbours) const;
    [[nodiscard]] bool passes_on(std::uint32_t worker, const Neighbours& neighbours) const;
    [[nodiscard]] int sellers(std::uint32_t buyer, const Neighbours& neighbours) const;
    void sell(Holdings& holdings, const Neighbours& neighbours);
    void send_home(Holdings& holdings, const Neighbours& neighbours);
    void put_in(Holdings& holdings, std::size_t lot);
    void credit(Worker& worker, int bodies, double cost);

    std::uint32_t self_;
    MarketSettings settings_;
    std::map<std::uint32_t, Worker> workers_;  // members, with this one
    std::uint64_t turn_steps_;                 // from turn to turn
    std::uint64_t step_ = 0, not_before_ = 0;
    Turn turn_ = Turn::none;  // this worker's in this step
    double lasting_ = 0;      // above the average when both turns before this one began, as a share of it
    double work_ = 0;         // own, of a step; smoothed over few steps
    double many_seconds_ = 0, many_work_ = 0;  // of a step; smoothed over many
    double steps_known_ = 0;                   // of these
    bool free_ = false;                        // to sell out of turn
    bool spreads_ = false;                     // free, because somebody owned nothing
    int far_steps_ = 0;                        // in a row
    // What was sold since a worker began to sell out of turn, and whether it helps.
    struct Go {
        std::uint64_t judged_at = 0;  // 0: none
        double most = 0, sold = 0;    // [s]
        double hoped = 0;             // own time after it [s]
    };
    Go go_;
    std::uint64_t patience_ = 0;  // steps without sale after the next that does not help
    double carried_ = 0;          // [s] to be sold with a later offer
    Sale sale_ = Sale::none;
    Offer offer_;
    double offer_cost_ = 0;              // [s] here
    std::optional<double> handed_over_;  // of bodies whose registration has not come [s]
    std::uint32_t next_number_ = 0;
    bool patient_ = true;  // see stop_waiting
    /// By seller, in the order of its offers: what was accepted and is not registered, what it will cost here [s].
    std::map<std::uint32_t, std::deque<double>> promises_;
};

}  // namespace sim
