#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "shared/replica_protocol.h"

namespace sim {

/// One worker's dealings (thesis 2.4): whoever needs more time a step than the average offers some of its
/// work to the fastest, by what everybody tells of themselves. No planner. T^i [s]: smoothed time worked a
/// step, not waited.
///
///   W^i T^i = (T^i - T^avg) / max(1, N - 2)     (2.32)   seconds offered; what is no whole body is carried
///   on
///
/// Departures: no more is offered than makes both equally slow, or the buyer as slow as the average; a buyer
/// that would become slower than the seller declines; what is sold moves from one T to the other at once, not
/// by and by, and reports from before count no more (epochs tell), or stale figures would sell the same work
/// twice. While anybody is above the average by more than 15 % and one body, trade is free; once level only
/// what lasts makes it so again, and else the slowest of all sells one body at a time, beyond the dead band,
/// and not within 20 steps of anybody's last trade.
class Market {
public:
    /// near_only: once level, bodies go only to who owns what is near them.
    Market(std::uint32_t self, const MarketSettings& settings, bool near_only);

    void members(const std::vector<std::uint32_t>& workers);
    /// Another worker's report, written when it knew ownership up to `epoch`.
    void heard(std::uint32_t worker, std::uint32_t epoch, const StepReport& report);
    void registered(std::uint32_t epoch, const Ownership& ownership);
    /// Own step `step` took so long, for so much work (World::work).
    void worked(std::uint64_t step, double seconds, double work, int own);

    // Selling: one offer at a time, until it is declined or handed over.
    [[nodiscard]] bool wants_to_sell() const;
    [[nodiscard]] std::uint32_t fastest() const;
    /// Of these lots; nothing if none fits.
    [[nodiscard]] std::optional<Offer> make_offer(std::vector<ReplicaProtocol::Lot> lots);
    void answered(std::uint32_t worker, const OfferAnswer& answer);
    /// The offer that was accepted, if one was; counts as handed over.
    [[nodiscard]] std::optional<Offer> hand_over();

    /// Buying.
    [[nodiscard]] OfferAnswer answer(std::uint32_t seller, const Offer& offer);

    [[nodiscard]] double smoothed() const { return workers_.at(self_).smoothed; }

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
    double usual_rate_ = 0;                                       // seconds a unit of work, while calm
    double carried_ = 0;                                          // [s] to be sold with a later offer
    Sale sale_ = Sale::none;
    Offer offer_;
    double offer_cost_ = 0;   // [s] here
    double handed_over_ = 0;  // of bodies whose registration has not come [s]
    std::uint32_t next_number_ = 0;
    std::map<std::uint32_t, double> promises_;  // by seller: what it will cost here [s]
};

/// Seconds a step that the seller's bodies take at the buyer, for each at the seller.
[[nodiscard]] double exchange_rate(double seller_body_cost, double buyer_body_cost);

}  // namespace sim
