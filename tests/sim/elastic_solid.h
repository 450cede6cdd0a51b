#pragma once
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

namespace sim {

/// A deforming solid that shares nothing with the library: 8-node bricks of St. Venant-Kirchhoff material (large rotations
/// and strains), lumped mass, explicit central differences (Belytschko, Liu, Moran, "Nonlinear Finite Elements
/// for Continua and Structures", 6.2), above the rigid plane y = 0, at which nodes stop and hold (Coulomb).
///
///   F = sum x_a grad N_a,  E = (F^T F - 1) / 2,  S = lambda tr(E) 1 + 2 mu E,  f_a = -integral F S grad N_a
class ElasticSolid {
public:
    struct Matter {
        double young_pa, poisson, density_kg_m3;
    };
    using Place = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;

    /// `rest` carries the cube [-1, 1]^3 onto the body, body frame; cells a side, along x, y and z.
    ElasticSolid(const std::array<int, 3>& cells, const Place& rest, const Matter& matter) : cells_(cells) {
        lambda_ = matter.young_pa * matter.poisson / ((1 + matter.poisson) * (1 - 2 * matter.poisson));
        mu_ = matter.young_pa / (2 * (1 + matter.poisson));
        const Eigen::Vector3i n(cells[0] + 1, cells[1] + 1, cells[2] + 1);
        for (int i = 0; i < n.prod(); ++i) {
            const Eigen::Vector3i at(i % n[0], i / n[0] % n[1], i / n[0] / n[1]);
            const Eigen::Vector3d t =
                2 * at.cast<double>().cwiseQuotient((n.array() - 1).matrix().cast<double>()) -
                Eigen::Vector3d::Ones();
            rest_.push_back(rest(t));
            if (t.cwiseAbs().maxCoeff() > 1 - 1e-9) surface_.push_back(i);
        }
        mass_.assign(rest_.size(), 0);
        add_cells(n, matter.density_kg_m3);
        // Of the stiffest cell: the shortest edge over the speed of pressure waves.
        stable_s_ = shortest_ / std::sqrt((lambda_ + 2 * mu_) / matter.density_kg_m3);
        place = rest_;
        velocity.assign(rest_.size(), Eigen::Vector3d::Zero());
        force_.resize(rest_.size());
    }

    std::vector<Eigen::Vector3d> place, velocity;  ///< of the nodes, world
    Eigen::Vector3d gravity = Eigen::Vector3d::Zero();
    double friction = 0.5;
    bool floor = true;  ///< the plane y = 0

    void start(const Eigen::Isometry3d& world_from_body, const Eigen::Vector3d& speed,
               const Eigen::Vector3d& spin) {
        for (std::size_t i = 0; i < rest_.size(); ++i) {
            place[i] = world_from_body * rest_[i];
            velocity[i] = speed + spin.cross(place[i] - world_from_body.translation());
        }
    }
    /// In equal steps of at most 0.3 of what is stable.
    void run(double seconds) {
        const int steps = static_cast<int>(std::ceil(seconds / (0.3 * stable_s_)));
        for (int i = 0; i < steps; ++i) step(seconds / steps);
    }
    [[nodiscard]] const std::vector<int>& surface() const { return surface_; }
    [[nodiscard]] const Eigen::Vector3d& rest(int node) const { return rest_[std::size_t(node)]; }
    [[nodiscard]] double mass() const {
        double sum = 0;
        for (const double m : mass_) sum += m;
        return sum;
    }
    [[nodiscard]] Eigen::Vector3d centre() const {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (std::size_t i = 0; i < mass_.size(); ++i) sum += mass_[i] * place[i];
        return sum / mass();
    }
    [[nodiscard]] double energy() const {  ///< kinetic and elastic [J]
        double sum = 0;
        for (std::size_t i = 0; i < mass_.size(); ++i) sum += 0.5 * mass_[i] * velocity[i].squaredNorm();
        for (const Cell& cell : all_)
            for (const Point& p : cell.points) {
                const Eigen::Matrix3d f = gradient(cell, p);
                const Eigen::Matrix3d e = 0.5 * (f.transpose() * f - Eigen::Matrix3d::Identity());
                sum += p.volume * (0.5 * lambda_ * e.trace() * e.trace() + mu_ * e.squaredNorm());
            }
        return sum;
    }
    double drag_per_s = 0;  ///< of all motion: to come to rest

private:
    struct Point {
        Eigen::Matrix<double, 3, 8> slopes;  ///< grad N_a [1/m]
        double volume;
    };
    struct Cell {
        std::array<int, 8> nodes;
        std::array<Point, 8> points;
    };

    void add_cells(const Eigen::Vector3i& n, double density) {
        for (int c = 0; c < cells_[0] * cells_[1] * cells_[2]; ++c) {
            const Eigen::Vector3i at(c % cells_[0], c / cells_[0] % cells_[1], c / cells_[0] / cells_[1]);
            Cell cell;
            for (int a = 0; a < 8; ++a)
                cell.nodes[std::size_t(a)] =
                    at[0] + (a & 1) + n[0] * (at[1] + (a >> 1 & 1) + n[1] * (at[2] + (a >> 2)));
            for (int g = 0; g < 8; ++g) {
                Eigen::Vector3d t;
                for (int i = 0; i < 3; ++i) t[i] = (g >> i & 1 ? 1 : -1) / std::sqrt(3.0);
                Eigen::Matrix<double, 3, 8> local;
                Eigen::Matrix3d jacobian = Eigen::Matrix3d::Zero();
                Eigen::Matrix<double, 8, 1> value;
                for (int a = 0; a < 8; ++a) {
                    Eigen::Vector3d sign;
                    for (int i = 0; i < 3; ++i) sign[i] = a >> i & 1 ? 1 : -1;
                    const Eigen::Vector3d one = Eigen::Vector3d::Ones() + sign.cwiseProduct(t);
                    local.col(a) = 0.125 * sign.cwiseProduct(Eigen::Vector3d(one[1] * one[2], one[0] * one[2],
                                                                             one[0] * one[1]));
                    value[a] = 0.125 * one.prod();
                    jacobian += rest_[std::size_t(cell.nodes[std::size_t(a)])] * local.col(a).transpose();
                }
                Point& p = cell.points[std::size_t(g)];
                p.volume = jacobian.determinant();
                p.slopes = jacobian.inverse().transpose() * local;
                for (int a = 0; a < 8; ++a)
                    mass_[std::size_t(cell.nodes[std::size_t(a)])] += density * p.volume * value[a];
                shortest_ = std::min(shortest_, 1 / p.slopes.colwise().norm().maxCoeff());
            }
            all_.push_back(cell);
        }
    }
    [[nodiscard]] Eigen::Matrix3d gradient(const Cell& cell, const Point& p) const {
        Eigen::Matrix3d f = Eigen::Matrix3d::Zero();
        for (int a = 0; a < 8; ++a)
            f += place[std::size_t(cell.nodes[std::size_t(a)])] * p.slopes.col(a).transpose();
        return f;
    }
    void step(double h) {
        std::fill(force_.begin(), force_.end(), Eigen::Vector3d::Zero());
        for (const Cell& cell : all_)
            for (const Point& p : cell.points) {
                const Eigen::Matrix3d f = gradient(cell, p);
                const Eigen::Matrix3d e = 0.5 * (f.transpose() * f - Eigen::Matrix3d::Identity());
                const Eigen::Matrix3d s = lambda_ * e.trace() * Eigen::Matrix3d::Identity() + 2 * mu_ * e;
                const Eigen::Matrix<double, 3, 8> forces = p.volume * f * s * p.slopes;
                for (int a = 0; a < 8; ++a) force_[std::size_t(cell.nodes[std::size_t(a)])] -= forces.col(a);
            }
        for (std::size_t i = 0; i < place.size(); ++i) {
            Eigen::Vector3d& v = velocity[i];
            v += h * (force_[i] / mass_[i] + gravity - drag_per_s * v);
            if (floor && place[i].y() + h * v.y() < 0) {
                const double stopped = -place[i].y() / h - v.y();  // impulse per mass
                v.y() += stopped;
                const double slide = std::hypot(v.x(), v.z());
                const double keep = slide > 0 ? std::max(0.0, 1 - friction * stopped / slide) : 0;
                v.x() *= keep, v.z() *= keep;
            }
            place[i] += h * v;
        }
    }

    std::array<int, 3> cells_;
    double lambda_, mu_, shortest_ = 1e30, stable_s_ = 0;
    std::vector<Eigen::Vector3d> rest_, force_;
    std::vector<double> mass_;
    std::vector<int> surface_;
    std::vector<Cell> all_;
};

}  // namespace sim
