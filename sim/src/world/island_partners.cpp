#include <cmath>
#include <optional>

#include "world/island_solver.h"
#include "world/step_records.h"

// A large island by several partners, each in its own memory. Its slabs (IslandBlocks) are shared out in runs of
// neighbours. What lies within a run is swept by one partner; what crosses a border between two runs by both, each for
// itself, out of the same bits: before it they tell each other the velocities of the bodies on their side. So every contact sees
// the velocities that it would see if one swept all, and impulses need not be told. A substep has four such meetings or more.
//
// Impacts and soft springs are few. Bodies that they join are a group. Each partner that has one of a group's bodies, or a slab beside
// one, is told how the group moves, and computes what impacts and springs do to it.
//
// Only islands of which nobody has to know more within a step: no rebounds, no forces but those of soft springs, which all
// pull alike.

namespace sim {
namespace {

constexpr std::size_t kBytesOfMotion = 600;  // of a body with 12 modes, at most

bool is_impact(const Manifold& manifold) {
    return manifold.points[0].begins >= 0;
}

bool rests(Manifold& manifold) {
    if (manifold.restitution == 0) return true;
    unpack(manifold);
    return std::all_of(manifold.points.begin(), manifold.points.begin() + manifold.count,
                       [](const ManifoldPoint& p) { return p.normal_impulse > 0; });
}

// Ascending.
void keep_once(std::vector<std::uint32_t>& bodies) {
    std::ranges::sort(bodies);
    bodies.erase(std::ranges::unique(bodies).begin(), bodies.end());
}

}  // namespace

// Impacts of what does not rebound stay with their pairs.
bool IslandSolver::is_plain(const Island& island, bool impacts) const {
    auto manifold = [this](int m) -> Manifold& { return (*manifolds_)[static_cast<std::size_t>(m)]; };
    return island.bodies.size() >= kLeastDivided && forces_->empty() && !told_crossed_ &&
           !is_carried(island) &&
           std::ranges::none_of(island.bodies,
                                [this](int id) { return (*bodies_)[static_cast<std::size_t>(id)].pushed; }) &&
           std::ranges::all_of(
               island.manifolds, [&](Manifold& m) { return impacts ? m.restitution == 0 : rests(m); },
               manifold);
}

bool IslandSolver::is_uneven(const Manifold& manifold) const {
    if (manifold.b >= kFirstPlane || local(manifold.a) < 0 || local(manifold.b) < 0) return false;
    auto mass = [this](int id) { return (*bodies_)[static_cast<std::size_t>(id)].kind->mass.mass; };
    return std::max(mass(manifold.a) / mass(manifold.b), mass(manifold.b) / mass(manifold.a)) > kUneven;
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
    owner_of_slab_.resize(slabs);
    for (std::size_t p = 0; p < partners; ++p)
        for (std::size_t slab = cuts_[p]; slab < cuts_[p + 1]; ++slab)
            owner_of_slab_[slab] = static_cast<int>(p);
    for (Border& border : borders_) border.partner = -1;
    turns_.clear();
    if (first_slab_ == last_slab_) return;
    if (first_slab_ > 0) {
        borders_[0].partner = owner_of_slab_[first_slab_ - 1];
        borders_[0].block = blocks_.interface_after(first_slab_ - 1);
        find_border(borders_[0], first_slab_);
    }
    if (last_slab_ < slabs) {
        borders_[1].partner = owner_of_slab_[last_slab_];
        borders_[1].block = blocks_.interface_after(last_slab_ - 1);
        find_border(borders_[1], last_slab_ - 1);
    }
    order_turns();
}

// Which bodies springs and impacts join, whom that concerns, and in which substeps impacts are due.
void IslandSolver::find_groups(const Island& island) {
    const std::size_t partners = cuts_.size() - 1;
    std::vector<int>& root_of = next_of_;
    root_of.resize(rows_of_.size());
    for (std::size_t i = 0; i < root_of.size(); ++i) root_of[i] = static_cast<int>(i);
    auto root = [&](int body) {
        while (root_of[static_cast<std::size_t>(body)] != body)
            body = root_of[static_cast<std::size_t>(body)] =
                root_of[static_cast<std::size_t>(root_of[static_cast<std::size_t>(body)])];
        return body;
    };
    group_of_.assign(rows_of_.size(), -1);
    due_.clear(), spring_bodies_.clear();
    if (island.constraints.empty() && !any_impacts_) return;
    auto join = [&](int a, int b) {  // 0: in a group
        for (const int body : {a, b})
            if (body >= 0) group_of_[static_cast<std::size_t>(body)] = 0;
        if (a < 0 || b < 0) return;
        const int first = root(a), second = root(b);
        root_of[static_cast<std::size_t>(std::max(first, second))] = std::min(first, second);
    };
    auto moving = [this](int id) { return id >= 0 && id < kFirstPlane ? local(id) : -1; };
    for (const int c : island.constraints) {
        const PointConstraint& held = (*constraints_)[static_cast<std::size_t>(c)].definition;
        const int a = moving(held.body_a), b = moving(held.body_b);
        join(a, b);
        for (const int body : {a, b})
            if (body >= 0) spring_bodies_.push_back(static_cast<std::uint32_t>(body));
    }
    keep_once(spring_bodies_);
    for (const int m : island.manifolds) {
        const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(m)];
        if (!is_impact(manifold)) continue;
        const int a = moving(manifold.a), b = moving(manifold.b);
        join(a, b);
        const int substep = substep_of(manifold.points[0]);
        for (const int body : {a, b})
            if (body >= 0) due_.push_back({substep, static_cast<std::uint32_t>(body)});
    }
    std::ranges::sort(due_, {}, [](const Due& due) { return std::pair(due.substep, due.body); });
    // Each group's number at its root, which is its first body.
    int groups = 0;
    for (std::size_t i = 0; i < group_of_.size(); ++i) {
        if (group_of_[i] < 0) continue;
        const int first = root(static_cast<int>(i));
        group_of_[i] = first == static_cast<int>(i) ? groups++ : group_of_[static_cast<std::size_t>(first)];
    }
    concerned_.assign(static_cast<std::size_t>(groups) * partners, 0);
    for (std::size_t i = 0; i < group_of_.size(); ++i) {
        if (group_of_[i] < 0) continue;
        const std::size_t slab = blocks_.slab_of(i), from = slab > 0 ? slab - 1 : 0,
                          until = std::min(slab + 1, blocks_.slabs() - 1);
        for (std::size_t s = from; s <= until; ++s)
            concerned_[static_cast<std::size_t>(group_of_[i]) * partners +
                       static_cast<std::size_t>(owner_of_slab_[s])] = 1;
    }
}

// Whether a partner computes what springs and impacts do to a body.
bool IslandSolver::concerns(std::uint32_t body, int partner) const {
    return partner >= 0 && group_of_[body] >= 0 &&
           concerned_[static_cast<std::size_t>(group_of_[body]) * (cuts_.size() - 1) +
                      static_cast<std::size_t>(partner)] != 0;
}

bool IslandSolver::is_used(std::uint32_t body) const {
    if (!island_->constraints.empty() || blocks_.reaches_further()) return true;
    if (is_own_body(body) || concerns(body, part_)) return true;
    return std::ranges::any_of(borders_, [body](const Border& border) {
        return border.partner >= 0 && std::ranges::binary_search(border.theirs, body);
    });
}

bool IslandSolver::concerns_this(const Manifold& manifold) const {
    for (const int id : {manifold.a, manifold.b})
        if (id < kFirstPlane && local(id) >= 0) return concerns(static_cast<std::uint32_t>(local(id)), part_);
    return false;
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
    any_impacts_ = std::ranges::any_of(island.manifolds, is_impact, [this](int m) -> const Manifold& {
        return (*manifolds_)[static_cast<std::size_t>(m)];
    });
    if (!is_plain(island, any_impacts_)) return false;
    with_ = &with, part_ = with.self(), shares_ = shares;
    outside_of_.assign(static_cast<std::size_t>(with.count()), Eigen::Vector3d::Zero());
    begin(island);
    if (blocks_.slabs() < 2 || blocks_.reaches_further() ||
        (!springs_.empty() && may_go_directly(most_at_first()))) {
        forget_island();
        return false;
    }
    any_emerging_ = std::ranges::any_of(
        island.manifolds, [this](int m) { return (*manifolds_)[static_cast<std::size_t>(m)].emerging; });
    outside_before_ = outside_, limited_before_ = limited_;
    measures_.resize(rows_of_.size());
    each_own_body([this](std::size_t body) { measures_[body] = measure(*rows_of_[body].body); });
    note_springs();
    advance();
    meet_borders(Told::velocities);  // for residual()
    missed_ = 0, uneven_ = false;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
        if (!sweeps(blocks_[b])) continue;
        for (const ContactRows& c : contacts_in(blocks_[b])) {
            missed_ = std::max(missed_, residual(c));
            keep_impulse(c, *c.point);
        }
        uneven_ = uneven_ || std::ranges::any_of(blocks_.manifolds_of(b), [this](int m) {
                      return is_uneven((*manifolds_)[static_cast<std::size_t>(m)]);
                  });
    }
    each_own_body([this](std::size_t body) { measures_[body].after = energy_of(*rows_of_[body].body); });
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

// Tells those whom it concerns how own ones of these bodies move, and hears it of theirs; with the frames, which follow bodies by
// steps. As the substep begins, or after they moved.
void IslandSolver::meet_bodies(const std::vector<std::uint32_t>& bodies, bool moved) {
    const bool told = substep_ > 0 || moved;
    auto each_for = [&](int owner, int partner, auto visit) {
        for (const std::uint32_t body : bodies)
            if (owner_of_slab_[blocks_.slab_of(body)] == owner && concerns(body, partner)) visit(body);
    };
    for (int p = 0; told && p < with_->count(); ++p) {
        if (p == part_) continue;
        ByteWriter out;
        each_for(part_, p, [&](std::uint32_t body) {
            write_motion(out, body);
            out.matrix(rows_of_[body].frame);
            if (moved) write_floats(out, speeds_of(body));
        });
        if (!out.bytes().empty()) with_->tell(p, std::move(out.bytes()));
    }
    for (int p = 0; p < with_->count(); ++p) {
        if (p == part_) continue;
        std::optional<Partners::Bytes> heard;
        std::optional<ByteReader> in;
        each_for(p, part_, [&](std::uint32_t body) {
            BodyRows& rows = rows_of_[body];
            if (told && !heard) heard = with_->hear(p), in.emplace(*heard);
            if (told) read_meeting(*in, body, moved);
            if (!moved) load_velocities(rows);
        });
        if (in) in->expect_end();
    }
}

void IslandSolver::read_meeting(ByteReader& in, std::uint32_t body, bool moved) {
    read_motion(in, body, false);
    BodyRows& rows = rows_of_[body];
    Eigen::Matrix3d frame;
    for (double& x : frame.reshaped()) x = read_finite(in);
    rows.turned = rows.turned || frame != rows.frame;
    rows.frame = frame;
    rows.body_from_world = frame.transpose().cast<float>();
    if (!moved) return;
    read_floats(in, speeds_of(body));
    rows.place = rows.body->state.position;
}

// Before impacts and springs: the bodies of both, and, if there is any impact in this substep, which is returned, what is beside
// the borders.
bool IslandSolver::meet_everywhere() {
    meeting_bodies_ = spring_bodies_;
    const auto due = std::ranges::equal_range(due_, substep_, {}, &Due::substep);
    for (const Due& of : due) meeting_bodies_.push_back(of.body);
    keep_once(meeting_bodies_);
    if (!due.empty()) meet_borders(Told::states);
    if (!meeting_bodies_.empty()) meet_bodies(meeting_bodies_, false);
    for (const std::size_t i : impacts_)
        if (contacts_[i].begins == substep_ && substep_ > 0) write_contact(contacts_[i]);
    return !due.empty();
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
    out.number<std::uint8_t>(uneven_);
    each_body_of(part_, [&](const BodyRows& rows) {
        write(out, *rows.body);
        const auto body = static_cast<std::size_t>(&rows - rows_of_.data());
        const Measure& m = measures_[body];
        for (const double x : {m.energy, m.scale, m.speed, m.after}) out.number(x);
    });
    each_block_of(part_, [&](std::size_t b) {
        for (const int m : blocks_.manifolds_of(b))
            write_impulses(out, (*manifolds_)[static_cast<std::size_t>(m)]);
    });
    for (const SpringRows& s : springs_)
        if (counts_here(s)) out.matrix(s.moved), out.matrix(s.impulse), write_floats(out, {s.k[0], 9});
}

void IslandSolver::read_part(ByteReader& in, int partner) {
    missed_ = std::max(missed_, in.number<float>());
    limited_ += in.number<std::uint64_t>();
    for (double& p : outside_of_[static_cast<std::size_t>(partner)]) p = read_finite(in);
    uneven_ = in.flag() || uneven_;
    each_body_of(partner, [&](const BodyRows& rows) {
        read(in, *rows.body);
        const auto body = static_cast<std::size_t>(&rows - rows_of_.data());
        Measure& m = measures_[body];
        for (double* x : {&m.energy, &m.scale, &m.speed, &m.after}) *x = read_finite(in);
        m.size = size_of(*rows.body);
    });
    each_block_of(partner, [&](std::size_t b) {
        for (const int m : blocks_.manifolds_of(b))
            read_impulses(in, (*manifolds_)[static_cast<std::size_t>(m)]);
    });
    for (SpringRows& s : springs_) {
        if (owner_of_slab_[blocks_.slab_of(static_cast<std::size_t>(first_body(s)))] != partner) continue;
        for (Eigen::Vector3d* half : {&s.moved, &s.impulse})
            for (double& p : *half) p = read_finite(in);
        read_floats(in, {s.k[0], 9});
    }
}

bool IslandSolver::end_together() {
    sum_start();
    calmed_ = false;
    const bool far = static_cast<double>(missed_) > kMissedAtRest * smallest_ + kMissedShare * fastest_;
    const bool otherwise = !any_impacts_ && (far || uneven_) &&
                           may_go_directly(uneven_ ? most_with_springs() : most_with_contacts());
    if (!otherwise) {
        if (with_->self() >= 0) outside_of_[static_cast<std::size_t>(with_->self())] = outside_;
        outside_.setZero();
        for (const Eigen::Vector3d& part : outside_of_) outside_ += part;
        double energy = 0;
        for (const Measure& m : measures_) energy += m.after;
        if (springs_.empty() || any_contacts_) calmed_ = calm(with_springs(energy, direct_));
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
