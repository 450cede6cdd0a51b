#include <algorithm>
#include <cmath>
#include <string>

#include "modes/eigenproblem.h"
#include "modes/finite_element.h"
#include "modes/modal_basis.h"
#include "sim/errors.h"
#include "sim/modes.h"

namespace sim {
namespace {

// Largest ratio of extents that double precision allows, with up to three and with more elements per side.
constexpr double kFlattest = 1000, kFlattestOfMany = 100;
constexpr int kMostElements = 12, kMostModes = 300, kElementModes = 75;
constexpr double kEqual = 1e-9;  // relative: eigenvalues of one degenerate group

void expect(bool right, const std::string& what, double found, const std::string& expected) {
    if (!right) throw InputError("", what + " " + std::to_string(found), expected);
}

void check(const ModesRequest& request) {
    for (const double axis : request.shape.semi_axes)
        expect(std::isfinite(axis) && axis > 0, "semi-axis", axis, "more than 0 m");
    const double aspect = request.shape.semi_axes.maxCoeff() / request.shape.semi_axes.minCoeff();
    expect(
        aspect <= (request.elements <= 3 ? kFlattest : kFlattestOfMany), "longest over shortest extent",
        aspect,
        "at most 1000, at most 100 with four or more elements a side (the finer mesh for errors included)");
    const Material& m = request.material;
    expect(std::isfinite(m.young_pa) && m.young_pa > 0, "Young's modulus", m.young_pa, "more than 0 Pa");
    expect(m.poisson > -1 && m.poisson < 0.5, "Poisson's ratio", m.poisson,
           "between -1 and 0.5, both excluded");
    expect(std::isfinite(m.density_kg_m3) && m.density_kg_m3 > 0, "density", m.density_kg_m3,
           "more than 0 kg/m^3");
    expect(request.elements >= 1 && request.elements <= kMostElements, "elements a side", request.elements,
           "1 to 12");
    expect(request.count == -1 || (request.count >= 0 && request.count <= kMostModes), "count of modes",
           request.count, "0 to 300, or -1");
}

/// One solution with its place.
struct Candidate {
    double eigenvalue;
    int parity, index;  ///< class, and solution within it
};

int group_end(const std::vector<Candidate>& sorted, int first) {
    int end = first + 1;
    while (end < static_cast<int>(sorted.size()) &&
           sorted[end].eigenvalue - sorted[first].eigenvalue <= kEqual * sorted[first].eigenvalue)
        ++end;
    return end;
}

GroupCut group_cut(const std::vector<Candidate>& sorted, int count) {
    int first = 0, end = 0;
    while (end < count) {
        first = end;
        end = group_end(sorted, first);
    }
    return {count, end == count ? count : first, end};
}

/// Solves the classes until all modes up to a count, and the next group's border, are known.
class ModeSearch {
public:
    explicit ModeSearch(const ModesRequest& request)
        : model_(request.shape, request.domain, request.material, request.elements),
          solutions_(kParityClasses),
          wanted_(kParityClasses) {
        int unknowns = 0;
        for (int p = 0; p < kParityClasses; ++p) unknowns += model_.unknowns({p});
        count_ = std::min(request.count < 0 ? kElementModes : request.count, unknowns - 6);
        for (int p = 0; p < kParityClasses; ++p) solve(p, std::min(count_ / 8 + 8, model_.unknowns({p}) / 3));
    }

    void run() {
        for (;;) {
            collect();
            if (first_incomplete_ < 0 || is_enough()) break;
            solve(first_incomplete_, 2 * wanted_[first_incomplete_]);
        }
        count_ = std::min(count_, static_cast<int>(candidates_.size()));
    }

    [[nodiscard]] const FiniteElementModel& model() const { return model_; }
    [[nodiscard]] const std::vector<Candidate>& candidates() const { return candidates_; }
    [[nodiscard]] const ParitySolution& solution(int parity) const { return solutions_[parity]; }
    [[nodiscard]] int count() const { return count_; }

private:
    void solve(int parity, int wanted) {
        wanted_[parity] = wanted;
        solutions_[parity] = lowest_solutions(model_.problem({parity}), model_.eigenvalue_scale(), wanted);
    }

    // All solutions up to the highest that the class with the least reach knows.
    void collect() {
        double reach = std::numeric_limits<double>::infinity();
        first_incomplete_ = -1;
        for (int p = 0; p < kParityClasses; ++p) {
            const ParitySolution& s = solutions_[p];
            if (s.complete || s.eigenvalues[s.eigenvalues.size() - 1] >= reach) continue;
            reach = s.eigenvalues[s.eigenvalues.size() - 1];
            first_incomplete_ = p;
        }
        candidates_.clear();
        for (int p = 0; p < kParityClasses; ++p)
            for (int i = 0; i < solutions_[p].eigenvalues.size(); ++i)
                if (solutions_[p].eigenvalues[i] < reach * (1 - 1e-8))
                    candidates_.push_back({solutions_[p].eigenvalues[i], p, i});
        std::sort(candidates_.begin(), candidates_.end(), [](const Candidate& a, const Candidate& b) {
            return std::tuple(a.eigenvalue, a.parity, a.index) < std::tuple(b.eigenvalue, b.parity, b.index);
        });
    }

    // The group around `count` must end before what is known ends.
    [[nodiscard]] bool is_enough() const {
        const int known = static_cast<int>(candidates_.size());
        return count_ < known && group_cut(candidates_, count_).above < known;
    }

    FiniteElementModel model_;
    std::vector<ParitySolution> solutions_;
    std::vector<int> wanted_;
    std::vector<Candidate> candidates_;
    int count_ = 0, first_incomplete_ = -1;
};

class BasisWriter {
public:
    BasisWriter(const ModesRequest& request, const ModeSearch& search) : search_(search) {
        const int m = 2 * request.elements + 1;
        modes_.basis.half_extents = request.shape.semi_axes;
        modes_.basis.elements = request.elements;
        modes_.basis.omega.resize(search.count());
        modes_.basis.nodal.resize(3 * m * m * m, search.count());
    }

    FreeVibrationModes run() {
        write_eigenvalues();
        for (int first = 0; first < search_.count();) first = write_group(first);
        modes_.cut = group_cut(search_.candidates(), search_.count());
        return std::move(modes_);
    }

private:
    void write_eigenvalues() {
        std::vector<std::pair<double, int>> all;
        for (const int p : {1, 2, 4, 3, 5, 6}) all.emplace_back(search_.solution(p).rigid_eigenvalue, p);
        std::sort(all.begin(), all.end());
        for (const Candidate& c : search_.candidates()) all.emplace_back(c.eigenvalue, c.parity);
        modes_.eigenvalues.resize(static_cast<Eigen::Index>(all.size()));
        for (std::size_t i = 0; i < all.size(); ++i) {
            modes_.eigenvalues[static_cast<Eigen::Index>(i)] = all[i].first;
            modes_.parity.push_back(all[i].second);
        }
    }

    // Writes one group of equal eigenvalues, class by class; returns where the next begins.
    int write_group(int first) {
        const std::vector<Candidate>& all = search_.candidates();
        const int end = group_end(all, first);
        int filled = first;
        for (int p = 0; p < kParityClasses; ++p) {
            std::vector<int> members;
            for (int i = first; i < end; ++i)
                if (all[i].parity == p) members.push_back(all[i].index);
            if (members.empty()) continue;
            Eigen::MatrixXd span(modes_.basis.nodal.rows(), static_cast<Eigen::Index>(members.size()));
            for (std::size_t i = 0; i < members.size(); ++i)
                span.col(static_cast<Eigen::Index>(i)) =
                    search_.model().expand({p}, search_.solution(p).vectors.col(members[i]));
            make_canonical(span);
            for (Eigen::Index i = 0; i < span.cols(); ++i, ++filled) {
                modes_.parity[6 + filled] = p;
                if (filled < search_.count()) modes_.basis.nodal.col(filled) = span.col(i);
            }
        }
        for (int i = first; i < std::min(end, search_.count()); ++i)
            modes_.basis.omega[i] = std::sqrt(all[i].eigenvalue);
        return end;
    }

    const ModeSearch& search_;
    FreeVibrationModes modes_;
};

}  // namespace

FreeVibrationModes free_vibration_modes(const ModesRequest& request) {
    check(request);
    ModeSearch search(request);
    search.run();
    return BasisWriter(request, search).run();
}

}  // namespace sim
