#include "solver/block_cholesky.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

namespace sim {
namespace {

constexpr int kBody = 6;  // coordinates of a rigid body, the size that most have: known to the compiler
using Panel = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
using BodyPanel = Eigen::Map<Eigen::Matrix<double, kBody, kBody>, 0, Eigen::OuterStride<>>;
using RowTriple = Eigen::Map<const Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::RowMajor>>;
using BodyTriple = Eigen::Map<const Eigen::Matrix<double, 3, kBody, Eigen::RowMajor>>;

}  // namespace

void BlockCholesky::begin(const std::vector<int>& sizes) {
    sizes_ = sizes;
    offsets_.resize(sizes.size());
    int offset = 0;
    for (std::size_t i = 0; i < sizes.size(); ++i) offsets_[i] = offset, offset += sizes[i];
    words_ = (sizes.size() + 63) / 64;
    neighbours_.assign(sizes.size() * words_, 0);
}

void BlockCholesky::couple(int a, int b) {
    if (a == b || a < 0 || b < 0) return;
    for (const auto& [of, to] : {std::pair{a, b}, std::pair{b, a}})
        neighbours_[static_cast<std::size_t>(of) * words_ + static_cast<std::size_t>(to) / 64] |=
            std::uint64_t{1} << (to % 64);
}

template <typename Visitor>
void BlockCholesky::each_neighbour(std::size_t node, Visitor visit) const {
    for (std::size_t w = 0; w < words_; ++w)
        for (std::uint64_t left = neighbours_[node * words_ + w]; left != 0; left &= left - 1)
            visit(w * 64 + static_cast<std::size_t>(std::countr_zero(left)));
}

double BlockCholesky::least_cost() const {
    double cost = 0;
    for (std::size_t i = 0; i < sizes_.size(); ++i) {
        const double n = sizes_[i];
        cost += n * n * n / 6;
        each_neighbour(i, [&](std::size_t other) {
            if (other > i) cost += n * sizes_[other] * (n + sizes_[other]) / 2;
        });
    }
    return cost;
}

double BlockCholesky::analyse(double most) {
    const std::size_t nodes = sizes_.size();
    heights_.resize(nodes);
    auto measure = [this](std::size_t node) {
        heights_[node] = 0;
        each_neighbour(node, [&](std::size_t other) { heights_[node] += sizes_[other]; });
    };
    for (std::size_t i = 0; i < nodes; ++i) measure(i);
    position_.assign(nodes, -1);
    columns_.clear(), blocks_.clear();
    double cost = 0;
    std::size_t used = 0;
    for (std::size_t step = 0; step < nodes; ++step) {
        std::size_t least = nodes;
        int fewest = std::numeric_limits<int>::max();
        for (std::size_t i = 0; i < nodes; ++i)
            if (position_[i] < 0 && heights_[i] < fewest) fewest = heights_[i], least = i;
        Column column;
        column.node = static_cast<int>(least), column.size = sizes_[least];
        column.height = static_cast<std::uint32_t>(column.size + fewest);
        column.start = static_cast<std::uint32_t>(used);
        column.first = static_cast<std::uint32_t>(blocks_.size());
        used += static_cast<std::size_t>(column.height) * static_cast<std::size_t>(column.size);
        const double d = column.size, m = fewest;
        cost += d * d * d / 6 + d * d * m / 2 + d * m * m / 2;
        if (cost > most) return std::numeric_limits<double>::infinity();
        position_[least] = static_cast<int>(step);
        // Its neighbours become neighbours of each other.
        each_neighbour(least, [&](std::size_t node) {
            blocks_.push_back({static_cast<int>(node), 0});  // nodes for now
            std::uint64_t* of = neighbours_.data() + node * words_;
            for (std::size_t w = 0; w < words_; ++w) of[w] |= neighbours_[least * words_ + w];
            for (const std::size_t gone : {node, least}) of[gone / 64] &= ~(std::uint64_t{1} << gone % 64);
        });
        each_neighbour(least, measure);
        column.count = static_cast<std::uint32_t>(blocks_.size()) - column.first;
        columns_.push_back(column);
    }
    for (Column& column : columns_) {
        const auto first = blocks_.begin() + column.first, last = first + column.count;
        for (auto at = first; at != last; ++at)
            at->position = position_[static_cast<std::size_t>(at->position)];
        std::sort(first, last, [](const Block& a, const Block& b) { return a.position < b.position; });
        std::uint32_t rows = static_cast<std::uint32_t>(column.size);
        for (auto at = first; at != last; ++at) {
            at->below = rows;
            rows += static_cast<std::uint32_t>(columns_[static_cast<std::size_t>(at->position)].size);
        }
    }
    values_.resize(used);
    return cost;
}

void BlockCholesky::reset() {
    std::fill(values_.begin(), values_.end(), 0.);
    for (const Column& column : columns_)
        for (int i = 0; i < column.size; ++i)
            values_[column.start + static_cast<std::size_t>(i) * (column.height + 1)] = 1;
}

double* BlockCholesky::block(int row, int column) {
    const Column& c = columns_[static_cast<std::size_t>(column)];
    if (row == column) return values_.data() + c.start;
    const auto first = blocks_.begin() + c.first;
    const auto at = std::lower_bound(first, first + c.count, row,
                                     [](const Block& b, int wanted) { return b.position < wanted; });
    return values_.data() + c.start + at->below;
}

void BlockCholesky::add(int a, const double* rows_a, int b, const double* rows_b,
                        const Eigen::Matrix3d& weight) {
    if (a >= 0 && b >= 0 && position_[static_cast<std::size_t>(a)] > position_[static_cast<std::size_t>(b)]) {
        std::swap(a, b);
        std::swap(rows_a, rows_b);
    }
    auto put = [this, &weight](int row, const double* of_row, int column, const double* of_column) {
        const int height = sizes_[static_cast<std::size_t>(row)],
                  width = sizes_[static_cast<std::size_t>(column)];
        const int at = position_[static_cast<std::size_t>(column)];
        Panel target(block(position_[static_cast<std::size_t>(row)], at), height, width,
                     Eigen::OuterStride<>(columns_[static_cast<std::size_t>(at)].height));
        if (height == kBody && width == kBody) {
            const Eigen::Matrix<double, 3, kBody> weighted = weight * BodyTriple(of_column);
            BodyPanel(target.data(), Eigen::OuterStride<>(target.outerStride())).noalias() +=
                BodyTriple(of_row).transpose() * weighted;
            return;
        }
        const RowTriple left(of_row, 3, height), right(of_column, 3, width);
        for (int j = 0; j < width; ++j) {
            const Eigen::Vector3d w = weight * right.col(j);
            for (int i = 0; i < height; ++i) target(i, j) += left.col(i).dot(w);
        }
    };
    if (a >= 0) put(a, rows_a, a, rows_a);
    if (b >= 0) put(b, rows_b, b, rows_b);
    if (a >= 0 && b >= 0) put(b, rows_b, a, rows_a);
}

// kSize: of the column, kBody, or Eigen::Dynamic.
template <int kSize>
void BlockCholesky::factor_column(const Column& c) {
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, kSize>, 0, Eigen::OuterStride<>> panel(
        values_.data() + c.start, c.height, c.size, Eigen::OuterStride<>(c.height));
    for (int j = 0; j < c.size; ++j) {  // unblocked: at most some tens of columns
        const int below = static_cast<int>(c.height) - j;
        auto column = panel.col(j).tail(below);
        for (int k = 0; k < j; ++k) column -= panel(j, k) * panel.col(k).tail(below);
        column /= std::sqrt(std::max(column[0], 1e-300));
    }
    for (std::uint32_t j = 0; j < c.count; ++j) {
        const Block& column = blocks_[c.first + j];
        const Column& target = columns_[static_cast<std::size_t>(column.position)];
        for (std::uint32_t i = j; i < c.count; ++i) {
            const Block& row = blocks_[c.first + i];
            const int rows = columns_[static_cast<std::size_t>(row.position)].size;
            double* at = block(row.position, column.position);
            if (kSize == kBody && rows == kBody && target.size == kBody) {
                BodyPanel(at, Eigen::OuterStride<>(target.height)).noalias() -=
                    panel.template middleRows<kBody>(row.below) *
                    panel.template middleRows<kBody>(column.below).transpose();
            } else {
                Panel(at, rows, target.size, Eigen::OuterStride<>(target.height)).noalias() -=
                    panel.middleRows(row.below, rows)
                        .lazyProduct(panel.middleRows(column.below, target.size).transpose());
            }
        }
    }
}

void BlockCholesky::factor() {
    for (const Column& c : columns_)
        c.size == kBody ? factor_column<kBody>(c) : factor_column<Eigen::Dynamic>(c);
}

// x <- L^-1 x of a column, and x <- L^-T x.
template <int kSize>
void BlockCholesky::solve_down(const Column& c, double* x) const {
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, kSize>, 0, Eigen::OuterStride<>> panel(
        values_.data() + c.start, c.height, c.size, Eigen::OuterStride<>(c.height));
    Eigen::Map<Eigen::Matrix<double, kSize, 1>> own(x + offset(c.node), c.size);
    for (int j = 0; j < c.size; ++j) {
        own[j] /= panel(j, j);
        for (int i = j + 1; i < c.size; ++i) own[i] -= panel(i, j) * own[j];
    }
    for (std::uint32_t i = 0; i < c.count; ++i) {
        const Block& row = blocks_[c.first + i];
        const Column& other = columns_[static_cast<std::size_t>(row.position)];
        Eigen::Map<Eigen::VectorXd>(x + offset(other.node), other.size).noalias() -=
            panel.middleRows(row.below, other.size).lazyProduct(own);
    }
}

template <int kSize>
void BlockCholesky::solve_up(const Column& c, double* x) const {
    const Eigen::Map<const Eigen::Matrix<double, Eigen::Dynamic, kSize>, 0, Eigen::OuterStride<>> panel(
        values_.data() + c.start, c.height, c.size, Eigen::OuterStride<>(c.height));
    Eigen::Map<Eigen::Matrix<double, kSize, 1>> own(x + offset(c.node), c.size);
    for (std::uint32_t i = 0; i < c.count; ++i) {
        const Block& row = blocks_[c.first + i];
        const Column& other = columns_[static_cast<std::size_t>(row.position)];
        own.noalias() -=
            panel.middleRows(row.below, other.size)
                .transpose()
                .lazyProduct(Eigen::Map<const Eigen::VectorXd>(x + offset(other.node), other.size));
    }
    for (int j = c.size - 1; j >= 0; --j) {
        for (int i = j + 1; i < c.size; ++i) own[j] -= panel(i, j) * own[i];
        own[j] /= panel(j, j);
    }
}

void BlockCholesky::solve(double* x) const {
    for (const Column& c : columns_)
        c.size == kBody ? solve_down<kBody>(c, x) : solve_down<Eigen::Dynamic>(c, x);
    for (auto c = columns_.rbegin(); c != columns_.rend(); ++c)
        c->size == kBody ? solve_up<kBody>(*c, x) : solve_up<Eigen::Dynamic>(*c, x);
}

}  // namespace sim
