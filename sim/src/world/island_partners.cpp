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

// Which bodies springs and impacts join, and in which substeps impacts are due.
void IslandSolver::find_groups() {
    joined_.clear(), due_.clear(), spring_bodies_.clear();
    auto moving = [this](int id) { return id >= 0 && id < kFirstPlane ? local(id) : -1; };
    for (const int c : island_->constraints) {
        const PointConstraint& held = (*constraints_)[static_cast<std::size_t>(c)].definition;
        joined_.emplace_back(moving(held.body_a), moving(held.body_b));
        for (const int body : {joined_.back().first, joined_.back().second})
            if (body >= 0) spring_bodies_.push_back(static_cast<std::uint32_t>(body));
    }
    keep_once(spring_bodies_);
    for (std::size_t i = 0; any_impacts_ && i < island_->manifolds.size(); ++i) {
        const Manifold& manifold = (*manifolds_)[static_cast<std::size_t>(island_->manifolds[i])];
        if (!is_impact(manifold)) continue;
        joined_.emplace_back(moving(manifold.a), moving(manifold.b));
        const int substep = substep_of(manifold.points[0]);
        for (const int body : {joined_.back().first, joined_.back().second})
            if (body >= 0) due_.push_back({substep, static_cast<std::uint32_t>(body)});
    }
    std::ranges::sort(due_, {}, [](const Due& due) { return std::pair(due.substep, due.body); });
    shares_.group(rows_of_.size(), joined_);
}

bool IslandSolver::is_used(std::uint32_t body) const {
    return !island_->constraints.empty() || blocks_.reaches_further() || shares_.uses(body);
}

bool IslandSolver::concerns_this(const Manifold& manifold) const {
    for (const int id : {manifold.a, manifold.b})
        if (id < kFirstPlane && local(id) >= 0)
            return shares_.concerns(static_cast<std::size_t>(local(id)), shares_.self());
    return false;
}

bool IslandSolver::begin_together(const Island& island, const ContactScene& scene, Partners& with,
                                  const std::vector<double>& shares,
                                  const std::function<void(int id)>& changes) {
    scene_ = &scene, island_ = &island, follow_ = carried_ = false;
    any_impacts_ = std::ranges::any_of(island.manifolds, is_impact, [this](int m) -> const Manifold& {
        return (*manifolds_)[static_cast<std::size_t>(m)];
    });
    if (!is_plain(island, any_impacts_)) return false;
    with_ = &with, wanted_ = shares;
    outside_of_.assign(static_cast<std::size_t>(with.count()), Eigen::Vector3d::Zero());
    begin(island);
    if (blocks_.slabs() < 2 || blocks_.reaches_further() ||
        (!springs_.empty() && may_go_directly(most_at_first()))) {
        forget_island();
        return false;
    }
    for (std::size_t i = 0; i < rows_of_.size(); ++i)
        if (is_used(static_cast<std::uint32_t>(i))) changes(island.bodies[i]);
    any_emerging_ = std::ranges::any_of(
        island.manifolds, [this](int m) { return (*manifolds_)[static_cast<std::size_t>(m)].emerging; });
    outside_before_ = outside_, limited_before_ = limited_;
    measures_.resize(rows_of_.size());
    shares_.each_body_of(shares_.self(),
                         [this](std::size_t body) { measures_[body] = measure(*rows_of_[body].body); });
    note_springs();
    advance();
    meet_borders(Told::velocities);  // for residual()
    missed_ = 0, uneven_ = false;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
        if (!shares_.sweeps(blocks_[b])) continue;
        for (const ContactRows& c : contacts_in(blocks_[b])) {
            missed_ = std::max(missed_, residual(c));
            keep_impulse(c, *c.point);
        }
        uneven_ = uneven_ || std::ranges::any_of(blocks_.manifolds_of(b), [this](int m) {
                      return is_uneven((*manifolds_)[static_cast<std::size_t>(m)]);
                  });
    }
    shares_.each_body_of(shares_.self(), [this](std::size_t body) {
        measures_[body].after = energy_of(*rows_of_[body].body);
    });
    return true;
}

// As IslandBlocks::run, of what this partner sweeps.
void IslandSolver::run_together() {
    for (const Phase& phase : phases_) {
        if (phase.of_bodies) {
            shares_.each_slab_of(shares_.self(), [&](std::size_t s) { (this->*phase.act)(blocks_[s]); });
            continue;
        }
        const bool told = phase.told != Told::nothing && phase.told != Told::skipped;
        for (const IslandShares::Turn& turn : shares_.turns()) {
            if (turn.border < 0) {
                (this->*phase.act)(blocks_[turn.block]);
            } else if (const Border& border = shares_.borders()[static_cast<std::size_t>(turn.border)];
                       turn.tells) {
                if (told) tell(border, phase.told);
            } else {
                if (told) hear(border, phase.told);
                if (phase.told != Told::skipped) (this->*phase.act)(blocks_[turn.block]);
            }
        }
    }
    phases_.clear();
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
    for (const Border& border : shares_.borders())
        if (border.partner >= 0)
            for (const std::uint32_t body : border.theirs) rows_of_[body].turned = false;
}

void IslandSolver::meet_borders(Told told) {
    for (const Border& border : shares_.borders())
        if (border.partner >= 0) tell(border, told);
    for (const Border& border : shares_.borders())
        if (border.partner >= 0) hear(border, told);
}

// Tells those whom it concerns how own ones of these bodies move, and hears it of theirs; with the frames, which follow bodies by
// steps. As the substep begins, or after they moved.
void IslandSolver::meet_bodies(const std::vector<std::uint32_t>& bodies, bool moved) {
    const bool told = substep_ > 0 || moved;
    auto each_for = [&](int owner, int partner, auto visit) {
        for (const std::uint32_t body : bodies)
            if (shares_.owner_of(body) == owner && shares_.concerns(body, partner)) visit(body);
    };
    for (int p = 0; told && p < with_->count(); ++p) {
        if (p == shares_.self()) continue;
        ByteWriter out;
        each_for(shares_.self(), p, [&](std::uint32_t body) {
            write_motion(out, body);
            out.matrix(rows_of_[body].frame);
            if (moved) write_floats(out, speeds_of(body));
        });
        if (!out.bytes().empty()) with_->tell(p, std::move(out.bytes()));
    }
    for (int p = 0; p < with_->count(); ++p) {
        if (p == shares_.self()) continue;
        std::optional<Partners::Bytes> heard;
        std::optional<ByteReader> in;
        each_for(p, shares_.self(), [&](std::uint32_t body) {
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

void IslandSolver::write_part(ByteWriter& out) const {
    out.number(missed_);
    out.number(limited_ - limited_before_);
    out.matrix(outside_);
    out.number<std::uint8_t>(uneven_);
    shares_.each_body_of(shares_.self(), [&](std::size_t body) {
        write(out, *rows_of_[body].body);
        const Measure& m = measures_[body];
        for (const double x : {m.energy, m.scale, m.speed, m.after}) out.number(x);
    });
    shares_.each_block_of(shares_.self(), [&](std::size_t b) {
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
    shares_.each_body_of(partner, [&](std::size_t body) {
        read(in, *rows_of_[body].body);
        Measure& m = measures_[body];
        for (double* x : {&m.energy, &m.scale, &m.speed, &m.after}) *x = read_finite(in);
        m.size = size_of(*rows_of_[body].body);
    });
    shares_.each_block_of(partner, [&](std::size_t b) {
        for (const int m : blocks_.manifolds_of(b))
            read_impulses(in, (*manifolds_)[static_cast<std::size_t>(m)]);
    });
    for (SpringRows& s : springs_) {
        if (shares_.owner_of(static_cast<std::size_t>(first_body(s))) != partner) continue;
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
    shares_.each_body_of(shares_.self(), [&](std::size_t body) { write(out, path_of(body)); });
}

void IslandSolver::read_paths(ByteReader& in, int partner) {
    shares_.each_body_of(partner, [&](std::size_t body) { read(in, path_of(body), settings_->dt); });
}

}  // namespace sim
