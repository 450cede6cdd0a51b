#include "solver/island_solver.h"

#include <atomic>
#include <cmath>

namespace sim {
namespace {

// Constants: value; unit; why; what breaks without it.
// [energy of motion and of weight times size] Gain in a step beyond which a direct solution is worse than sweeps: contacts of
// bodies deep in each other contradict each other. Without: such bodies are thrown apart.
constexpr double kWorse = 3e-3;
// Speeds by which swept contacts may miss what they demand: at rest, of the smallest body's size a second, and as a share of the
// fastest body's. More: stacks of ten fall; less: piles are solved directly for nothing.
constexpr double kMissedAtRest = 1e-3, kMissedShare = 0.03;
// Ratio of masses that touch. Beyond it sweeps let the heavier press the lighter away within a step.
constexpr double kUneven = 30;

}  // namespace

void IslandSolver::begin_step(std::uint64_t step, const std::vector<ActiveForce>& forces) noexcept {
    rows_.substep.first = static_cast<double>(step) * rows_.settings.substeps;
    forces_.begin_step(forces);
}

void IslandSolver::solve(const Island& island, const ContactScene& scene, bool follow) {
    followed_ = follow && found_.may_follow(island);
    carried_ = is_carried(island);
    begin(island, scene);
    energy_.note_start();
    if (followed_) {
        (void)found_.find_at_start();
        impacts_.begin();
        (void)direct_.begin(direct_.most_with_springs(), true);
    }
    advance();
    if (!rows_.directly && !rows_.any_impacts && !rows_.any_struck && !rows_.cross.among_ghosts())
        solve_better();
    // Joints alone give back what they take, within a step or over several.
    if (!may_gain() && !rows_.cross.any() && (rows_.springs.empty() || !island.manifolds.empty()))
        energy_.take_gain(energy_.energy(rows_.directly));
    forces_.end();
    broken_ += static_cast<std::uint64_t>(rows_.end());
}

void IslandSolver::begin(const Island& island, const ContactScene& scene) {
    rows_.begin(island, scene);
    found_.note_places();
    impacts_.begin();
    direct_.begin_step();
    forces_.begin();
    if (!rows_.springs.empty() || !rows_.any_contacts)
        (void)direct_.begin(rows_.cross.among_ghosts() ? 0 : direct_.most_at_first(), rows_.springs.empty());
}

void IslandSolver::advance() {
    const int substeps = rows_.settings.substeps;
    for (int i = 0; i < substeps; ++i) {
        rows_.substep.remaining = rows_.substep.h * (substeps - 1 - i);
        rows_.substep.number = i, rows_.substep.passed = 0;
        const bool last = i + 1 == substeps;
        rows_.directly ? direct_.substep(0, last, followed_) : sweeps_.substep(carried_, last);
    }
}

void IslandSolver::go_back() {
    forces_.end();
    energy_.go_back();
    begin(*rows_.island, *rows_.scene);
}

// Directly, where sweeps left contacts far from solved or masses are uneven, and the exact answer is better.
void IslandSolver::solve_better() {
    const bool uneven = is_uneven();
    if (!uneven && !is_far_from_solved()) return;
    const double most = uneven ? direct_.most_with_springs() : direct_.most_with_contacts();
    if (!direct_.begin(most)) return;
    // Of contacts that contradict each other the exact answer is worse than sweeps that give up: where nothing
    // else may give energy, it shows by that.
    const double swept = energy_.energy(true);
    go_back();
    (void)direct_.begin(most);
    energy_.note_start();
    advance();
    const double gained = energy_.energy(true) - std::max(swept, energy_.before());
    if (may_gain() || gained < kWorse * energy_.scale()) return;
    go_back();
    energy_.note_start();
    advance();
}

bool IslandSolver::may_gain() const {
    return carried_ ||
           std::ranges::any_of(rows_.bodies, [](const BodyRows& rows) { return rows.body->pushed; });
}

bool IslandSolver::is_far_from_solved() const {
    return sweeps_.residual() > kMissedAtRest * energy_.smallest() + kMissedShare * energy_.fastest();
}

// Whether bodies touch much lighter ones.
bool IslandSolver::is_uneven() const {
    std::atomic<bool> uneven = false;
    rows_.crew().each(rows_.contacts.size(), 64, [&](int, std::size_t first, std::size_t last) {
        for (const ContactRows& c : std::span(rows_.contacts).subspan(first, last - first)) {
            if (c.side[0].body < 0 || c.side[1].body < 0) continue;
            auto mass = [&](int side) {
                return rows_.bodies[static_cast<std::size_t>(c.side[side].body)].body->kind->mass.mass;
            };
            if (std::max(mass(0) / mass(1), mass(1) / mass(0)) > kUneven)
                uneven.store(true, std::memory_order_relaxed);
        }
    });
    return uneven;
}

}  // namespace sim
