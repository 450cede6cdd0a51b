#include <cmath>

#include "world/island_solver.h"
#include "world/step_records.h"

// A large island by several partners, each in its own memory. Its slabs (IslandBlocks) are shared out in runs of
// neighbours. What lies within a run is swept by one partner; what crosses a border between two runs by both, each for
// itself, out of the same bits: before it they tell each other the velocities of the bodies on their side. So every contact sees
// the velocities that it would see if one swept all, and impulses need not be told. A substep has four such meetings.
//
// Only islands of which nobody has to know everything within a step: no impacts, no rebounds, no forces but those of soft
// springs, which all pull alike.

namespace sim {
namespace {

bool rests(const Manifold& manifold) {
    if (manifold.points[0].begins >= 0) return false;
    return manifold.restitution == 0 ||
           std::all_of(manifold.points.begin(), manifold.points.begin() + manifold.count,
                       [](const ManifoldPoint& p) { return p.normal_impulse > 0; });
}

}  // namespace

bool IslandSolver::is_plain(const Island& island) const {
    return island.bodies.size() >= kLeastDivided && forces_->empty() && !told_crossed_ &&
           !is_carried(island) &&
           std::ranges::none_of(island.bodies,
                                [this](int id) { return (*bodies_)[static_cast<std::size_t>(id)].pushed; }) &&
           std::ranges::all_of(island.manifolds,
                               [this](int m) { return rests((*manifolds_)[static_cast<std::size_t>(m)]); });
}

// As is_uneven, of all contacts.
bool IslandSolver::is_uneven_island() const {
    return std::ranges::any_of(island_->manifolds, [this](int m) {
        const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        if (manifold.b >= kFirstPlane || local(manifold.a) < 0 || local(manifold.b) < 0) return false;
        auto mass = [this](int id) { return (*bodies_)[static_cast<std::size_t>(id)].kind->mass.mass; };
        return std::max(mass(manifold.a) / mass(manifold.b), mass(manifold.b) / mass(manifold.a)) > kUneven;
    });
}

// Whether begin_direct might take it, or would have to look closer.
bool IslandSolver::may_be_direct(double most) {
    return !(is_too_dear(most) && springs_are_soft());
}

// Slabs in runs of about equal numbers of contacts, by the partners' shares of the bodies.
void IslandSolver::cut() {
    const auto partners = static_cast<std::size_t>(with_->count()), slabs = blocks_.slabs();
    std::vector<double> share(partners, 0), load(slabs, 0);
    for (const int id : island_->bodies) ++share[static_cast<std::size_t>(with_->of(id))];
    for (std::size_t s = 0; s < slabs; ++s)
        load[s] += 1 + static_cast<double>(blocks_.manifolds_of(s).size());
    for (std::size_t s = 0; s + 1 < slabs; ++s) {
        const double half = static_cast<double>(blocks_.manifolds_of(blocks_.interface_after(s)).size()) / 2;
        load[s] += half, load[s + 1] += half;
    }
    double all = 0, bodies = 0, before = 0;
    for (const double l : load) all += l;
    for (const double b : share) bodies += b;
    cuts_.assign(partners + 1, slabs);
    cuts_[0] = 0;
    std::size_t partner = 0;
    double until = share[0] / bodies * all;
    for (std::size_t s = 0; s < slabs; ++s) {
        const double middle = before + load[s] / 2;
        while (partner + 1 < partners && middle > until) {
            cuts_[++partner] = s;
            until += share[partner] / bodies * all;
        }
        before += load[s];
    }
    const auto self = static_cast<std::size_t>(with_->self());
    first_slab_ = cuts_[self], last_slab_ = cuts_[self + 1];
    auto owner = [&](std::size_t slab) {
        std::size_t p = 0;
        while (cuts_[p + 1] <= slab) ++p;
        return static_cast<int>(p);
    };
    for (Border& border : borders_) border.partner = -1;
    if (first_slab_ == last_slab_) return;
    if (first_slab_ > 0) {
        borders_[0].partner = owner(first_slab_ - 1);
        borders_[0].block = blocks_.interface_after(first_slab_ - 1);
        find_border(borders_[0], first_slab_);
    }
    if (last_slab_ < slabs) {
        borders_[1].partner = owner(last_slab_);
        borders_[1].block = blocks_.interface_after(last_slab_ - 1);
        find_border(borders_[1], last_slab_ - 1);
    }
}

void IslandSolver::find_border(Border& border, std::size_t own_slab) {
    border.own.clear(), border.theirs.clear();
    for (const int m : blocks_.manifolds_of(border.block)) {
        const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        for (const int id : {manifold.a, manifold.b}) {
            const auto body = static_cast<std::size_t>(local(id));
            (blocks_.slab_of(body) == own_slab ? border.own : border.theirs)
                .push_back(static_cast<std::uint32_t>(body));
        }
    }
    for (auto* bodies : {&border.own, &border.theirs}) {
        std::ranges::sort(*bodies);
        bodies->erase(std::ranges::unique(*bodies).begin(), bodies->end());
    }
}

bool IslandSolver::begin_together(const Island& island, const ContactScene& scene, Partners& with) {
    scene_ = &scene, island_ = &island, follow_ = carried_ = false;
    if (!is_plain(island)) return false;
    with_ = &with, part_ = with.self();
    begin(island);
    if (blocks_.slabs() < 2 || blocks_.reaches_further() ||
        (!springs_.empty() && may_be_direct(most_with_springs()))) {
        forget_island();
        return false;
    }
    spring_bodies_.clear();
    for (const SpringRows& s : springs_)
        for (const Side& side : s.side)
            if (side.body >= 0) spring_bodies_.push_back(static_cast<std::uint32_t>(side.body));
    std::ranges::sort(spring_bodies_);
    spring_bodies_.erase(std::ranges::unique(spring_bodies_).begin(), spring_bodies_.end());
    any_emerging_ = std::ranges::any_of(
        island.manifolds, [this](int m) { return (*manifolds_)[static_cast<std::size_t>(m)].emerging; });
    note_start();
    advance();
    for (const Border& border : borders_)
        if (border.partner >= 0) meet(border, Told::velocities);  // for residual()
    missed_ = 0;
    for (std::size_t b = 0; b < blocks_.size(); ++b)
        if (sweeps(blocks_[b]))
            for (const ContactRows& c : contacts_in(blocks_[b])) {
                missed_ = std::max(missed_, residual(c));
                keep_impulse(c, *c.point);
            }
    return true;
}

// As IslandBlocks::run, of what this partner sweeps.
void IslandSolver::run_together() {
    for (const Phase& phase : phases_) {
        if (phase.of_bodies) {
            for (std::size_t s = first_slab_; s < last_slab_; ++s) (this->*phase.act)(blocks_[s]);
            continue;
        }
        for (std::size_t b = 0; b < blocks_.size(); ++b) {
            if (!sweeps(blocks_[b])) continue;
            for (const Border& border : borders_)
                if (border.partner >= 0 && border.block == b) {
                    if (phase.told == Told::skipped) goto next;
                    if (phase.told != Told::nothing) meet(border, phase.told);
                }
            (this->*phase.act)(blocks_[b]);
        next:;
        }
    }
    phases_.clear();
}

void IslandSolver::write_motion(ByteWriter& out, std::uint32_t body) const {
    const BodyRows& rows = rows_of_[body];
    write(out, *rows.body);
    write_floats(out, std::span(moved_.data() + rows.offset, static_cast<std::size_t>(rows.width)));
}

// The state at the substep's start, and what begins with it.
void IslandSolver::read_motion(ByteReader& in, std::uint32_t body) {
    BodyRows& rows = rows_of_[body];
    read(in, *rows.body);
    read_floats(in, std::span(moved_.data() + rows.offset, static_cast<std::size_t>(rows.width)));
}

void IslandSolver::meet(const Border& border, Told told) {
    ByteWriter out;
    auto speeds_of = [this](std::uint32_t body) {
        const BodyRows& rows = rows_of_[body];
        return std::span(y_.data() + rows.offset, static_cast<std::size_t>(rows.width));
    };
    const bool later = substep_ > 0 && told == Told::states;
    for (const std::uint32_t body : border.own) {
        if (later) write_motion(out, body);
        write_floats(out, speeds_of(body));
        if (told == Told::places)
            for (int k = 0; k < 3; ++k) out.number(rows_of_[body].place[k]);
    }
    with_->tell(border.partner, std::move(out.bytes()));
    const Partners::Bytes heard = with_->hear(border.partner);
    ByteReader in(heard);
    for (const std::uint32_t body : border.theirs) {
        BodyRows& rows = rows_of_[body];
        if (later) {
            read_motion(in, body);
            turn_frame_on(rows);
        }
        if (told == Told::states) load_velocities(rows);
        read_floats(in, speeds_of(body));
        if (told == Told::places)
            for (int k = 0; k < 3; ++k) rows.place[k] = read_finite(in);
    }
    in.expect_end();
    if (later) turn_rows(blocks_[border.block]);
}

// Before springs pull: the bodies at their ends, wherever they are.
void IslandSolver::meet_springs() {
    if (substep_ > 0) {
        ByteWriter out;
        for (const std::uint32_t body : spring_bodies_)
            if (is_own_body(body)) write_motion(out, body);
        with_->tell_all(std::move(out.bytes()));
        for (int p = 0; p < with_->count(); ++p) {
            if (p == with_->self()) continue;
            const Partners::Bytes heard = with_->hear(p);
            ByteReader in(heard);
            for (const std::uint32_t body : spring_bodies_) {
                const std::size_t slab = blocks_.slab_of(body);
                if (slab < cuts_[static_cast<std::size_t>(p)] ||
                    slab >= cuts_[static_cast<std::size_t>(p) + 1])
                    continue;
                read_motion(in, body);
                turn_frame_on(rows_of_[body]);
            }
            in.expect_end();
        }
    }
    for (const std::uint32_t body : spring_bodies_)
        if (!is_own_body(body)) load_velocities(rows_of_[body]);
}

bool IslandSolver::any_of_all(bool here) {
    with_->tell_all({static_cast<std::uint8_t>(here)});
    for (int p = 0; p < with_->count(); ++p) {
        if (p == with_->self()) continue;
        const Partners::Bytes heard = with_->hear(p);
        ByteReader in(heard);
        here = in.flag() || here;
        in.expect_end();
    }
    return here;
}

template <typename Body>
void IslandSolver::each_body_of(int partner, Body visit) const {
    const auto p = static_cast<std::size_t>(partner);
    for (std::size_t s = cuts_[p]; s < cuts_[p + 1]; ++s)
        for (const std::uint32_t body : blocks_.bodies_of(s)) visit(rows_of_[body]);
}

// Of those that two sweep one tells.
template <typename Block>
void IslandSolver::each_block_of(int partner, Block visit) const {
    const auto p = static_cast<std::size_t>(partner);
    for (std::size_t b = 0; b < blocks_.size(); ++b)
        if (blocks_[b].slab >= cuts_[p] && blocks_[b].slab < cuts_[p + 1]) visit(b);
}

void IslandSolver::write_part(ByteWriter& out) const {
    out.number(missed_);
    out.number(limited_ - limited_before_);
    each_body_of(part_, [&](const BodyRows& rows) { write(out, *rows.body); });
    each_block_of(part_, [&](std::size_t b) {
        for (const int m : blocks_.manifolds_of(b))
            write_impulses(out, (*manifolds_)[static_cast<std::size_t>(m)]);
    });
}

void IslandSolver::read_part(ByteReader& in, int partner) {
    missed_ = std::max(missed_, in.number<float>());
    limited_ += in.number<std::uint64_t>();
    each_body_of(partner, [&](const BodyRows& rows) { read(in, *rows.body); });
    each_block_of(partner, [&](std::size_t b) {
        for (const int m : blocks_.manifolds_of(b))
            read_impulses(in, (*manifolds_)[static_cast<std::size_t>(m)]);
    });
}

bool IslandSolver::end_together() {
    const bool far = static_cast<double>(missed_) > kMissedAtRest * smallest_ + kMissedShare * fastest_,
               uneven = is_uneven_island();
    const bool otherwise =
        (far || uneven) && may_be_direct(uneven ? most_with_springs() : most_with_contacts());
    if (!otherwise) {
        const Eigen::Vector3d swept = outside_;
        calm();
        if (with_->self() != 0) outside_ = swept;  // one counts what all do alike
        keep_spring_impulses();
    }
    forget_island();
    return !otherwise;
}

void IslandSolver::give_up() noexcept {
    if (with_) forget_island();
    phases_.clear();
    (void)take_outside_impulse();
}

void IslandSolver::write_paths(ByteWriter& out) const {
    each_body_of(part_, [&](const BodyRows& rows) {
        write(out, (*paths_)[static_cast<std::size_t>(rows.body - bodies_->data())]);
    });
}

void IslandSolver::read_paths(ByteReader& in, int partner) {
    each_body_of(partner, [&](const BodyRows& rows) {
        read(in, (*paths_)[static_cast<std::size_t>(rows.body - bodies_->data())], settings_->dt);
    });
}

}  // namespace sim
