#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "shared/replica_protocol.h"

namespace sim {

/// One worker's load-balancing policy, a market without a planner (thesis 2.4): a worker that needs more time
/// per step than the average offers some of its work to the fastest, by the workers' own reports.
///
///   W^i T^i = (T^i - T^avg) / max(1, N - 2)     (2.32)
///   T^i  smoothed seconds that worker i works per step (not waits), N workers
///   W^i T^i  seconds offered; what is less than a whole body is carried to the next offer
///
/// Departures: an offer never makes the buyer slower than the seller or than the average; a buyer that would
/// become slower than the seller declines; sold work counts for the buyer at once, and reports written before
/// the registration (older epoch) are ignored, otherwise stale figures would sell the same work twice. While
/// any worker is above the average by more than 15 % and one body, trade is free. Once level, only a lasting
/// difference frees it again; otherwise the slowest worker sells one body at a time, beyond the dead band,
/// and not within 20 steps of the last trade of any worker.
class Market {
public:
    /// near_only: once level, a body is sold only to the owner of bodies near it.
    Market(std::uint32_t self, const MarketSettings& settings, bool near_only);

    void members(const std::vector<std::uint32_t>& workers);  ///< sets the members
    /// Takes another worker's report, written when it knew ownership up to `epoch`.
    void heard(std::uint32_t worker, std::uint32_t epoch, const StepReport& report);
    void registered(std::uint32_t epoch, const Ownership& ownership);
    /// Takes own step `step`: its seconds, its work (World::work), the number of own bodies.
    void worked(std::uint64_t step, double seconds, double work, int own);

    // Selling: one offer at a time, until it is declined or handed over.
    [[nodiscard]] bool wants_to_sell() const;
    [[nodiscard]] std::uint32_t fastest() const;
    /// An offer of some of these lots; none if no lot fits.
    [[nodiscard]] std::optional<Offer> make_offer(std::vector<ReplicaProtocol::Lot> lots);
    void answered(std::uint32_t worker, const OfferAnswer& answer);
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
        [[nodiscard]] double body_cost() const { return own > 0 ? smoothed / own : 0; }
    };
    enum class Sale { none, offered, accepted };

    [[nodiscard]] double average() const;
    [[nodiscard]] double allowance(const Worker& worker) const;
    [[nodiscard]] bool level() const;
    [[nodiscard]] bool slowest() const;
    [[nodiscard]] bool tuning() const;
    [[nodiscard]] double wanted() const;
    void watch_level();
    [[nodiscard]] bool changed_speed(double rate);
    void credit(Worker& worker, int bodies, double cost);

    std::uint32_t self_;
    MarketSettings settings_;
    bool near_only_;
    double weight_;
    std::map<std::uint32_t, Worker> workers_;  // members, with this one
    std::uint64_t step_ = 0, last_trade_ = 0, not_before_ = 0;
    bool traded_ = false;
    bool known_ = false;                                          // own time
    bool calm_ = false;                                           // has been level, and nothing lasting since
    int far_steps_ = 0, other_rate_steps_ = 0, level_steps_ = 0;  // in a row
    double usual_rate_ = 0;                                       // seconds per unit of work, while calm
    double carried_ = 0;                                          // [s] to be sold with a later offer
    Sale sale_ = Sale::none;
    Offer offer_;
    double offer_cost_ = 0;   // [s] here
    double handed_over_ = 0;  // of bodies whose registration has not come [s]
    std::uint32_t next_number_ = 0;
    std::map<std::uint32_t, double> promises_;  // by seller: what it will cost here [s]
};

/// Seconds that the seller's bodies take at the buyer, per second at the seller.
[[nodiscard]] double exchange_rate(double seller_body_cost, double buyer_body_cost);

}  // namespace sim
