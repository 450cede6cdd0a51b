#include "shared/market.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "messages/worker_messages.h"
#include "shared_scenes.h"

using namespace world_test;

namespace {

/// Workers that do nothing but trade columns of one body each, by telling each other at once: a market alone.
class Fair {
public:
    /// A grid of columns; those of the same `pile` touch, and others are far away.
    Fair(int workers, int wide, int deep, int piles = 1) : speed(static_cast<std::size_t>(workers), 1.0) {
        sim::MarketSettings settings;
        std::vector<std::uint32_t> members;
        for (int i = 0; i < workers; ++i) members.push_back(static_cast<std::uint32_t>(i));
        for (const std::uint32_t i : members) markets_.emplace_back(i, settings, 0).set_members(members);
        for (int p = 0; p < piles; ++p)
            for (int x = 0; x < wide; ++x)
                for (int y = 0; y < deep; ++y) columns.push_back({x + 1000 * p, y});
        owner.assign(columns.size(), 0);
        cost.assign(columns.size(), 1);
    }

    [[nodiscard]] double seconds(std::uint32_t worker) const {
        double sum = 0;
        for (std::size_t i = 0; i < owner.size(); ++i) sum += owner[i] == worker ? cost[i] : 0;
        return sum * speed[worker];
    }
    [[nodiscard]] int own(std::uint32_t worker) const {
        return static_cast<int>(std::count(owner.begin(), owner.end(), worker));
    }
    /// Largest over the mean, less one.
    [[nodiscard]] double excess() const {
        double most = 0, sum = 0;
        for (std::uint32_t i = 0; i < markets_.size(); ++i)
            most = std::max(most, seconds(i)), sum += seconds(i);
        return most * static_cast<double>(markets_.size()) / sum - 1;
    }
    [[nodiscard]] sim::Holdings holdings(std::uint32_t self) const {
        sim::Holdings holdings(self);
        for (std::size_t i = 0; i < owner.size(); ++i) {
            holdings.add(columns[i], owner[i], 1);
            if (owner[i] == self) holdings.add({columns[i], {static_cast<std::uint32_t>(i)}, cost[i], true});
        }
        return holdings;
    }
    /// All do a step, one after the other; returns the columns that changed hands.
    int step() {
        ++step_;
        int sold = 0;
        for (std::uint32_t w = 0; w < markets_.size(); ++w) {
            sim::Market& market = markets_[w];
            const double work = seconds(w) / speed[w];
            if (own(w) > 0) market.end_step(step_, seconds(w), work, own(w));
            sim::StepReport report;
            report.smoothed_s = static_cast<float>(market.smoothed());
            report.own = static_cast<std::uint32_t>(own(w));
            for (std::uint32_t other = 0; own(w) > 0 && other < markets_.size(); ++other)
                if (other != w)
                    markets_[other].receive_report({w, epoch_, step_}, report.smoothed_s, report.own);
        }
        for (std::uint32_t w = 0; w < markets_.size(); ++w) {
            if (!markets_[w].wants_to_sell()) continue;
            const auto offer = markets_[w].make_offer(holdings(w));
            if (!offer) continue;
            offered = *offer;
            const sim::OfferAnswer answer = markets_[offer->to].answer(w, *offer);
            EXPECT_TRUE(answer.accepted) << "step " << step_ << ", " << w << " to " << offer->to;
            markets_[w].receive_answer(offer->to, {w, offer->number, answer.accepted});
            if (!markets_[w].hand_over()) continue;
            sim::Ownership ownership;
            ownership.owner = offer->to, ownership.from = w, ownership.traded = true, ownership.step = step_;
            for (const std::uint32_t body : offer->bodies) {
                owner[body] = offer->to;
                ownership.bodies.emplace_back().body = static_cast<int>(body);
            }
            ++epoch_;
            for (sim::Market& market : markets_) market.register_sale(epoch_, ownership);
            sold += static_cast<int>(offer->bodies.size());
        }
        return sold;
    }

    std::vector<double> speed;  // of a worker: seconds per cost
    std::vector<sim::Column> columns;
    std::vector<std::uint32_t> owner;
    std::vector<double> cost;
    sim::Offer offered;

private:
    std::vector<sim::Market> markets_;
    std::uint64_t step_ = 0;
    std::uint32_t epoch_ = 0;
};

/// Neighbouring pairs of columns with different owners.
int border(const Fair& fair) {
    int sum = 0;
    for (std::size_t i = 0; i < fair.columns.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            sum += std::abs(fair.columns[i].x - fair.columns[j].x) +
                           std::abs(fair.columns[i].y - fair.columns[j].y) ==
                       1 &&
                   fair.owner[i] != fair.owner[j];
    return sum;
}

}  // namespace

TEST(Market, AllOnOneIsLevelWithinTenStepsAndStaysSoInCompactRegions) {
    for (const auto& [workers, wide, deep] :
         {std::tuple(3, 6, 5), std::tuple(10, 6, 5), std::tuple(3, 20, 20), std::tuple(10, 20, 20),
          std::tuple(7, 40, 10)}) {
        Fair fair(workers, wide, deep);
        for (int i = 0; i < 10; ++i) (void)fair.step();
        const double column = static_cast<double>(workers) / (wide * deep);
        EXPECT_LE(fair.excess(), std::max(0.15, 1.01 * column)) << workers << " workers, " << wide * deep;
        int sold = 0;
        for (int i = 0; i < 100; ++i) sold += fair.step();
        EXPECT_LE(sold, 5) << workers;
        // Squares of that many columns have a border of 2 sqrt(area) each, counted once.
        const double squares = 2 * std::sqrt(wide * deep * workers);
        EXPECT_LT(border(fair), 1.6 * squares) << workers << " workers, " << wide * deep;
    }
}

TEST(Market, WhoeverIsSlowFindsABuyerInRowsAndAcrossSeparatePiles) {
    Draw draw(32);
    for (int trial = 0; trial < 40; ++trial) {
        const int workers = 2 + trial % 9, piles = 1 + trial % 2;
        Fair fair(workers, 60, 3, piles);
        // Stripes of random widths, all in one row: the slowest may be far from the fastest.
        std::vector<std::size_t> cuts;
        for (int w = 1; w < workers; ++w)
            cuts.push_back(static_cast<std::size_t>(draw.between(0, static_cast<double>(fair.owner.size()))));
        for (std::size_t i = 0; i < fair.owner.size(); ++i)
            fair.owner[i] = static_cast<std::uint32_t>(
                std::count_if(cuts.begin(), cuts.end(), [i](auto c) { return c <= i; }));
        fair.speed[0] = 2;
        for (int i = 0; i < 1500; ++i) (void)fair.step();
        // The dead band of 0.1, and a column's cost from neighbour to neighbour in a row; at first up to 9.
        EXPECT_LE(fair.excess(), 0.5) << workers << " workers, " << piles << " piles, trial " << trial;
    }
}

TEST(Market, ColumnsThatLieAmongAnothersGoHomeAndTimesStayLevel) {
    Fair fair(4, 20, 20);
    Draw draw(9);
    for (std::size_t i = 0; i < fair.owner.size(); ++i)
        fair.owner[i] = static_cast<std::uint32_t>(fair.columns[i].x / 10 + 2 * (fair.columns[i].y / 10));
    const int whole = border(fair);
    for (std::uint32_t& owner : fair.owner)
        if (draw.between(0, 1) < 0.1) owner = static_cast<std::uint32_t>(draw.between(0, 4));
    const int mixed = border(fair);
    for (int i = 0; i < 400; ++i) (void)fair.step();
    EXPECT_LT(border(fair) - whole, (mixed - whole) / 4);
    EXPECT_LE(fair.excess(), 0.12);
}

TEST(Market, OffersAreAFunctionOfReportsAlone) {
    Fair one(10, 20, 20), two(10, 20, 20);
    for (int i = 0; i < 60; ++i) {
        ASSERT_EQ(one.step(), two.step());
        ASSERT_EQ(one.offered.to, two.offered.to);
        ASSERT_EQ(one.offered.bodies, two.offered.bodies);
    }
    EXPECT_EQ(one.owner, two.owner);
}

// In a run.

namespace {

double unsteady(int worker, std::uint64_t step) {
    Draw draw(static_cast<unsigned>(1000 * worker) + static_cast<unsigned>(step));
    (void)draw.between(0, 1);
    return draw.between(0, 1) < 0.2 ? 2 : 1;
}

/// Balls apart on a floor, at rest but awake: what a step costs does not change.
sim::WorldScene at_rest(int wide, int deep) {
    sim::WorldScene scene;
    scene.world = on_floor();
    scene.world.settings.sleeping = false;
    for (int i = 0; i < wide * deep; ++i)
        scene.world.bodies.push_back(ball({1.25 * (i % wide), 0.5, 1.25 * (i / wide)}));
    return scene;
}

/// The first offer is made at the end of step 10.
sim::DistributedSettings all_on_one(std::uint64_t steps) {
    sim::DistributedSettings settings = for_steps(steps);
    settings.all_to_first = true;
    settings.market.from_step = 10;
    return settings;
}

/// Of the smoothed times as last told, when all have done a step: the largest over the mean, less one.
double excess(const Record& record, int workers, std::uint64_t step) {
    std::map<int, double> latest;
    double sum = 0, most = 0;
    for (const sim::WorkerStep& report : record.steps)
        if (report.step <= step) latest[report.worker] = report.smoothed_s;
    for (const auto& [worker, seconds] : latest) sum += seconds, most = std::max(most, seconds);
    return most * workers / sum - 1;
}

/// When columns changed hands, also those that went home.
class Sales : public Record {
public:
    void moved(std::uint64_t step, int bodies, int from, int to) override {
        Record::moved(step, bodies, from, to);
        if (from >= 0) steps_.push_back(step);
    }
    /// The most in so many steps, from step `first` on.
    [[nodiscard]] int most(std::uint64_t first, std::uint64_t span) const {
        int most = 0;
        for (const std::uint64_t start : steps_) {
            const auto within = [&](std::uint64_t s) { return s >= start && s < start + span; };
            if (start >= first) most = std::max(most, int(std::ranges::count_if(steps_, within)));
        }
        return most;
    }

private:
    std::vector<std::uint64_t> steps_;
};

}  // namespace

TEST(MarketRun, AllOnOneIsLevelWithinTenStepsThenAtMostOneSaleInTwentyOrTen) {
    for (const int workers : {3, 7, 10})
        for (const int wide : {6, 20})
            for (const bool steady : {true, false}) {
                const sim::WorldScene scene = at_rest(wide, wide == 6 ? 5 : 20);
                const sim::DistributedSettings settings = all_on_one(300);
                sim_bench::SimulatedProcessors how = processors(workers);
                how.latency_s = 2e-6;
                if (!steady) how.factor = unsteady;
                Sales record;
                const auto result = sim_bench::simulate_processors(scene, settings, how, record);
                EXPECT_EQ(result.refused_messages, 0u) << record.notes;
                const double column = double(workers) / double(scene.world.bodies.size());
                const std::string what = std::to_string(workers) + " workers, " +
                                         std::to_string(scene.world.bodies.size()) + " bodies" +
                                         (steady ? "" : ", unsteady");
                if (steady) {
                    EXPECT_LE(excess(record, workers, 21), std::max(0.15, 1.05 * column)) << what;
                }
                EXPECT_LE(steady ? record.most(22, 20) : record.most(40, 10), 1) << what;
            }
}

// Who owns all does not take steps while an answer is on its way.
TEST(MarketRun, AllOnOneIsLevelWithinTenStepsHoweverLongMessagesTake) {
    for (const int workers : {3, 10, 16})
        for (const int wide : {6, 20})
            for (const double latency : {2e-4, 2e-2}) {  // a step of one takes 30 to 400 us
                const sim::WorldScene scene = at_rest(wide, wide == 6 ? 5 : 20);
                const sim::DistributedSettings settings = all_on_one(30);
                sim_bench::SimulatedProcessors how = processors(workers);
                how.latency_s = latency;
                Record record;
                (void)sim_bench::simulate_processors(scene, settings, how, record);
                const double column = double(workers) / double(scene.world.bodies.size());
                EXPECT_LE(excess(record, workers, 20), std::max(0.15, 1.05 * column))
                    << workers << " workers, " << scene.world.bodies.size() << " bodies, " << latency;
            }
}

TEST(MarketRun, OneWorkerAtHalfSpeedCostsLittleWithBalancing) {
    const sim::WorldScene scene = at_rest(20, 10);
    for (const int slow : {0, 3}) {
        double elapsed[2];
        for (const bool trade : {false, true}) {
            sim::DistributedSettings settings = for_steps(800);
            settings.market.trade = trade;
            sim_bench::SimulatedProcessors how = processors(5);
            how.latency_s = 2e-6;
            how.factor = [slow](int worker, std::uint64_t) { return worker == slow ? 2.0 : 1.0; };
            Record record;
            elapsed[trade] = sim_bench::simulate_processors(scene, settings, how, record).elapsed_s;
        }
        // 2 / (5 / 4.5) = 1.8 at best; the first 10 steps and the sale take their time.
        EXPECT_GT(elapsed[0] / elapsed[1], 1.5) << slow;
    }
}
