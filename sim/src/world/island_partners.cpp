#include <cmath>

#include "world/island_solver.h"
#include "world/step_records.h"

// A large island by several partners, each in its own memory. Its slabs (IslandBlocks) are shared out in runs of
// neighbours. What lies within a run is swept by one partner; what crosses a border between two runs by both, each for
// itself, out of the same bits: before it they tell each other the velocities of the bodies on their side. So every contact sees
// the velocities that it would see if one swept all, and impulses need not be told. A substep has four such meetings or more.
//
// Impacts, which are few, each partner computes for itself, all of the island's, once their bodies have been told.
//
// Only islands of which nobody has to know more within a step: no rebounds, no forces but those of soft springs, which all
// pull alike.

namespace sim {
namespace {

constexpr std::size_t kBytesOfMotion = 600;  // of a body with 12 modes, at most

bool is_impact(const Manifold& manifold) {
    return manifold.points[0].begins >= 0;
}

bool rests(const Manifold& manifold) {
    return manifold.restitution == 0 ||
           std::all_of(manifold.points.begin(), manifold.points.begin() + manifold.count,
                       [](const ManifoldPoint& p) { return p.normal_impulse > 0; });
}

// Ascending.
void keep_once(std::vector<std::uint32_t>& bodies) {
    std::ranges::sort(bodies);
    bodies.erase(std::ranges::unique(bodies).begin(), bodies.end());
}

}  // namespace

// Impacts of what does not rebound stay with their pairs.
bool IslandSolver::is_plain(const Island& island) const {
    auto manifold = [this](int m) -> const Manifold& { return (*manifolds_)[static_cast<std::size_t>(m)]; };
    const bool impacts = std::ranges::any_of(island.manifolds, is_impact, manifold);
    return island.bodies.size() >= kLeastDivided && forces_->empty() && !told_crossed_ &&
           !is_carried(island) &&
           std::ranges::none_of(island.bodies,
                                [this](int id) { return (*bodies_)[static_cast<std::size_t>(id)].pushed; }) &&
           std::ranges::all_of(
               island.manifolds, [&](const Manifold& m) { return impacts ? m.restitution == 0 : rests(m); },
               manifold);
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

// Slabs in runs, of contacts as the partners' shares.
void IslandSolver::cut() {
    const auto partners = static_cast<std::size_t>(with_->count()), slabs = blocks_.slabs();
    std::vector<double>&share = shares_, load(slabs, 0);
    for (std::size_t s = 0; s < slabs; ++s)
        load[s] += 1 + static_cast<double>(blocks_.manifolds_of(s).size());
    for (std::size_t s = 0; s + 1 < slabs; ++s) {
        const double half = static_cast<double>(blocks_.manifolds_of(blocks_.interface_after(s)).size()) / 2;
        load[s] += half, load[s + 1] += half;
    }
    double all = 0, before = 0, shares = 0;
    for (const double l : load) all += l;
    for (const double s : share) shares += s;
    if (!(shares > 0)) share.assign(partners, 1), shares = static_cast<double>(partners);
    cuts_.assign(partners + 1, slabs);
    cuts_[0] = 0;
    std::size_t partner = 0;
    double until = share[0] / shares * all;
    for (std::size_t s = 0; s < slabs; ++s) {
        const double middle = before + load[s] / 2;
        while (partner + 1 < partners && middle > until) {
            cuts_[++partner] = s;
            until += share[partner] / shares * all;
        }
        before += load[s];
    }
    first_slab_ = last_slab_ = 0;
    if (const int self = with_->self(); self >= 0)
        first_slab_ = cuts_[static_cast<std::size_t>(self)],
        last_slab_ = cuts_[static_cast<std::size_t>(self) + 1];
    auto owner = [&](std::size_t slab) {
        std::size_t p = 0;
        while (cuts_[p + 1] <= slab) ++p;
        return static_cast<int>(p);
    };
    for (Border& border : borders_) border.partner = -1;
    turns_.clear();
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
    order_turns();
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
    keep_once(border.own), keep_once(border.theirs);
}

bool IslandSolver::begin_together(const Island& island, const ContactScene& scene, Partners& with,
                                  const std::vector<double>& shares) {
    scene_ = &scene, island_ = &island, follow_ = carried_ = false;
    if (!is_plain(island)) return false;
    with_ = &with, part_ = with.self(), shares_ = shares;
    outside_of_.assign(static_cast<std::size_t>(with.count()), Eigen::Vector3d::Zero());
    begin(island);
    if (blocks_.slabs() < 2 || blocks_.reaches_further() ||
        (!springs_.empty() && may_go_directly(most_at_first()))) {
        forget_island();
        return false;
    }
    spring_bodies_.clear();
    for (const SpringRows& s : springs_)
        for (const Side& side : s.side)
            if (side.body >= 0) spring_bodies_.push_back(static_cast<std::uint32_t>(side.body));
    keep_once(spring_bodies_);
    any_emerging_ = std::ranges::any_of(
        island.manifolds, [this](int m) { return (*manifolds_)[static_cast<std::size_t>(m)].emerging; });
    note_start();
    advance();
    meet_borders(Told::velocities);  // for residual()
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
        const bool told = phase.told != Told::nothing && phase.told != Told::skipped;
        for (const BlockTurn& turn : turns_) {
            if (turn.border < 0) {
                (this->*phase.act)(blocks_[turn.block]);
            } else if (const Border& border = borders_[static_cast<std::size_t>(turn.border)]; turn.tells) {
                if (told) tell(border, phase.told);
            } else {
                if (told) hear(border, phase.told);
                if (phase.told != Told::skipped) (this->*phase.act)(blocks_[turn.block]);
            }
        }
    }
    phases_.clear();
}

// In which order this partner's blocks are swept: as IslandBlocks has it, but what has no slab in common commutes, so what a
// neighbour waits for comes first, and what waits for a neighbour last.
void IslandSolver::order_turns() {
    turns_.clear();
    std::vector<std::size_t>& left = blocks_left_;
    left.clear();
    for (std::size_t b = 0; b < blocks_.size(); ++b)
        if (sweeps(blocks_[b])) left.push_back(b);
    auto border_of = [this](std::size_t block) {
        for (int i = 0; i < 2; ++i)
            if (const Border& border = borders_[static_cast<std::size_t>(i)];
                border.partner >= 0 && border.block == block)
                return i;
        return -1;
    };
    auto meets_within = [this](const IslandBlocks::Block& a, const IslandBlocks::Block& b) {
        const std::size_t first = std::max<std::size_t>({a.slab, b.slab, first_slab_}),
                          last = std::min<std::size_t>({a.slab + a.slabs, b.slab + b.slabs, last_slab_});
        return first < last;
    };
    auto waits = [&](std::size_t block, std::size_t before) {
        return before < block && meets_within(blocks_[before], blocks_[block]);
    };
    auto is_ready = [&](std::size_t block) {
        return std::ranges::none_of(left, [&](std::size_t before) { return waits(block, before); });
    };
    std::array<bool, 2> told{borders_[0].partner < 0, borders_[1].partner < 0};
    auto is_needed = [&](std::size_t block) {
        return (!told[0] && waits(borders_[0].block, block)) || (!told[1] && waits(borders_[1].block, block));
    };
    while (!left.empty()) {
        for (int i = 0; i < 2; ++i)
            if (const std::size_t at = static_cast<std::size_t>(i);
                !told[at] && is_ready(borders_[at].block)) {
                turns_.push_back({borders_[at].block, i, true});
                told[at] = true;
            }
        const std::size_t none = blocks_.size();
        std::size_t next = none, border = none;
        for (const std::size_t block : left) {
            if (!is_ready(block)) continue;
            if (border_of(block) >= 0) {
                border = std::min(border, block);
            } else if (next == none || (is_needed(block) && !is_needed(next))) {
                next = block;
            }
        }
        if (next == none) next = border;
        turns_.push_back({next, border_of(next), false});
        std::erase(left, next);
    }
}

void IslandSolver::write_motion(ByteWriter& out, std::uint32_t body) const {
    const BodyRows& rows = rows_of_[body];
    write(out, *rows.body);
    write_floats(out, std::span(moved_.data() + rows.offset, static_cast<std::size_t>(rows.width)));
}

// begins: the substep; what was told is in the frame that it begins with.
void IslandSolver::read_motion(ByteReader& in, std::uint32_t body, bool begins) {
    BodyRows& rows = rows_of_[body];
    read(in, *rows.body);
    if (begins) turn_frame_on(rows);
    read_floats(in, std::span(moved_.data() + rows.offset, static_cast<std::size_t>(rows.width)));
}

std::span<float> IslandSolver::speeds_of(std::uint32_t body) {
    const BodyRows& rows = rows_of_[body];
    return std::span(y_.data() + rows.offset, static_cast<std::size_t>(rows.width));
}

void IslandSolver::tell(const Border& border, Told told) {
    ByteWriter out;
    out.bytes().reserve(kBytesOfMotion * border.own.size());
    for (const std::uint32_t body : border.own) {
        if (substep_ > 0 && told == Told::states) write_motion(out, body);
        write_floats(out, speeds_of(body));
        if (told == Told::places) out.matrix(rows_of_[body].place);
    }
    with_->tell(border.partner, std::move(out.bytes()));
}

void IslandSolver::hear(const Border& border, Told told) {
    const Partners::Bytes heard = with_->hear(border.partner);
    ByteReader in(heard);
    const bool later = substep_ > 0 && told == Told::states;
    for (const std::uint32_t body : border.theirs) {
        BodyRows& rows = rows_of_[body];
        if (later) read_motion(in, body, true);
        if (told == Told::states) load_velocities(rows);
        read_floats(in, speeds_of(body));
        if (told == Told::places)
            for (double& x : rows.place) x = read_finite(in);
    }
    in.expect_end();
    if (later) turn_rows(blocks_[border.block]);
}

void IslandSolver::begin_borders() {
    for (const Border& border : borders_)
        if (border.partner >= 0)
            for (const std::uint32_t body : border.theirs) rows_of_[body].turned = false;
}

void IslandSolver::meet_borders(Told told) {
    for (const Border& border : borders_)
        if (border.partner >= 0) tell(border, told);
    for (const Border& border : borders_)
        if (border.partner >= 0) hear(border, told);
}

// Tells all others how own ones of these bodies move, and takes it of theirs, wherever they are; with the frames, which follow
// bodies by steps. As the substep begins, or after they moved.
void IslandSolver::meet_bodies(const std::vector<std::uint32_t>& bodies, bool moved) {
    if (substep_ > 0 || moved) {
        ByteWriter out;
        for (const std::uint32_t body : bodies)
            if (is_own_body(body)) {
                write_motion(out, body);
                out.matrix(rows_of_[body].frame);
                if (moved) write_floats(out, speeds_of(body));
            }
        with_->tell_all(std::move(out.bytes()));
        for (int p = 0; p < with_->count(); ++p) {
            if (p == with_->self()) continue;
            const Partners::Bytes heard = with_->hear(p);
            ByteReader in(heard);
            for (const std::uint32_t body : bodies) {
                const std::size_t slab = blocks_.slab_of(body);
                if (slab < cuts_[static_cast<std::size_t>(p)] ||
                    slab >= cuts_[static_cast<std::size_t>(p) + 1])
                    continue;
                read_motion(in, body, false);
                BodyRows& rows = rows_of_[body];
                Eigen::Matrix3d frame;
                for (double& x : frame.reshaped()) x = read_finite(in);
                rows.turned = rows.turned || frame != rows.frame;
                rows.frame = frame;
                rows.body_from_world = frame.transpose().cast<float>();
                if (!moved) continue;
                read_floats(in, speeds_of(body));
                rows.place = rows.body->state.position;
            }
            in.expect_end();
        }
    }
    for (const std::uint32_t body : bodies)
        if (!moved && !is_own_body(body)) load_velocities(rows_of_[body]);
}

// Before impacts and springs: the bodies of both, and, if there is any impact in this substep, which is returned, what is beside
// the borders.
bool IslandSolver::meet_everywhere() {
    meeting_bodies_ = spring_bodies_;
    auto is_due = [this](std::size_t contact) { return contacts_[contact].begins == substep_; };
    for (const std::size_t i : impacts_)
        for (const Side& side : contacts_[i].side)
            if (is_due(i) && side.body >= 0) meeting_bodies_.push_back(static_cast<std::uint32_t>(side.body));
    keep_once(meeting_bodies_);
    const bool any = std::ranges::any_of(impacts_, is_due);
    if (any) meet_borders(Told::states);
    if (!meeting_bodies_.empty()) meet_bodies(meeting_bodies_, false);
    for (const std::size_t i : impacts_)
        if (is_due(i) && substep_ > 0) write_contact(contacts_[i]);
    return any;
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
    out.matrix(outside_);
    each_body_of(part_, [&](const BodyRows& rows) { write(out, *rows.body); });
    each_block_of(part_, [&](std::size_t b) {
        for (const int m : blocks_.manifolds_of(b))
            write_impulses(out, (*manifolds_)[static_cast<std::size_t>(m)]);
    });
}

void IslandSolver::read_part(ByteReader& in, int partner) {
    missed_ = std::max(missed_, in.number<float>());
    limited_ += in.number<std::uint64_t>();
    for (double& p : outside_of_[static_cast<std::size_t>(partner)]) p = read_finite(in);
    each_body_of(partner, [&](const BodyRows& rows) { read(in, *rows.body); });
    each_block_of(partner, [&](std::size_t b) {
        for (const int m : blocks_.manifolds_of(b))
            read_impulses(in, (*manifolds_)[static_cast<std::size_t>(m)]);
    });
}

bool IslandSolver::end_together() {
    const bool far = static_cast<double>(missed_) > kMissedAtRest * smallest_ + kMissedShare * fastest_,
               uneven = is_uneven_island();
    const bool otherwise = impacts_.empty() && (far || uneven) &&
                           may_go_directly(uneven ? most_with_springs() : most_with_contacts());
    if (!otherwise) {
        if (with_->self() >= 0) outside_of_[static_cast<std::size_t>(with_->self())] = outside_;
        outside_.setZero();
        for (const Eigen::Vector3d& part : outside_of_) outside_ += part;
        calm();
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
