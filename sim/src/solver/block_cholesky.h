#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

namespace sim {

/// On a border that Eigen's kernels start from, so that sums are in the same order on every run.
using AlignedDoubles = std::vector<double, Eigen::aligned_allocator<double>>;

/// Cholesky factorisation A = L L^T of a symmetric positive definite matrix of dense blocks, one block row per
/// node (a body's coordinates), blocks off the diagonal where nodes are coupled. Nodes are eliminated by least
/// degree (Tinney and Walker 1967; ties: lowest number), so trees and chains cost O(nodes) without fill and
/// planar graphs little. Double precision, deterministic; allocates only while its buffers grow.
/// Use: begin, couple..., analyse; then any number of times reset, add..., factor, solve.
class BlockCholesky {
public:
    void begin(const std::vector<int>& sizes);  ///< rows of each node's block
    void couple(int a, int b);                  ///< in any order, repeated or not
    /// Multiply-adds of one factorisation are at least so many, in whatever order: of every coupled pair one is eliminated first,
    /// at n_1^2 n_2 / 2 + n_1 n_2^2 / 2 or more. Much cheaper than analyse.
    [[nodiscard]] double least_cost() const;
    /// Orders the elimination. Returns the multiply-adds of one factorisation, or infinity as soon as they
    /// exceed `most`: then the matrix must not be used.
    double analyse(double most);

    void reset();  ///< A = identity
    /// A_aa += rows_a^T weight rows_a, A_ab += rows_a^T weight rows_b, and so on; rows: 3 x size, row-major;
    /// weight symmetric. A node of -1 is left out.
    void add(int a, const double* rows_a, int b, const double* rows_b, const Eigen::Matrix3d& weight);
    void factor();                ///< A becomes L
    void solve(double* x) const;  ///< x <- A^-1 x; entries node by node as in `begin`

private:
    struct Column {  // of L, in order of elimination
        int node = 0, size = 0;
        std::uint32_t start = 0;   // in values_: height x size, column-major, the diagonal block first
        std::uint32_t height = 0;  // of all its blocks
        std::uint32_t first = 0, count = 0;  // of blocks_ below the diagonal
    };
    struct Block {
        int position;         // of its row's node in the elimination
        std::uint32_t below;  // rows of the column above it
    };
    double* block(int row, int column);  // by position; row >= column
    template <int kSize>
    void factor_column(const Column& c);
    template <int kSize>
    void solve_down(const Column& c, double* x) const;
    template <int kSize>
    void solve_up(const Column& c, double* x) const;
    [[nodiscard]] int offset(int node) const { return offsets_[static_cast<std::size_t>(node)]; }
    template <typename Visitor>
    void each_neighbour(std::size_t node, Visitor visit) const;  // ascending

    std::vector<int> sizes_, offsets_, position_;
    std::size_t words_ = 0;                  // of a node's row of neighbours_
    std::vector<std::uint64_t> neighbours_;  // a bit per node: coupled, and not yet eliminated
    std::vector<int> heights_;               // rows of a node's neighbours
    std::vector<Column> columns_;
    std::vector<Block> blocks_;
    AlignedDoubles values_;
};

}  // namespace sim
