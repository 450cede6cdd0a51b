#include "learned/network.h"

namespace tracking {
namespace {

using Eigen::Index;
using Packet = Eigen::internal::packet_traits<float>::type;
constexpr Index kLanes = Eigen::internal::packet_traits<float>::size;

/// Inputs that are zero without a direction of the shaft: velocities of the second point, the direction, whether it is
/// known.
constexpr Index kFirstOfShaft = 3 * static_cast<Index>(StickHistory::kSpans),
                kAfterShaft = 3 * static_cast<Index>(StickHistory::kVectors) + 1;

PathModel::Layer padded(const PathModel::Layer& layer, Index first_row, Index rows) {
    const Index whole = (rows + kLanes - 1) / kLanes * kLanes;
    PathModel::Layer out{Eigen::MatrixXf::Zero(whole, layer.weights.cols()), Eigen::VectorXf::Zero(whole)};
    out.weights.topRows(rows) = layer.weights.middleRows(first_row, rows);
    out.bias.head(rows) = layer.bias.segment(first_row, rows);
    return out;
}

/// y += W x for kPackets packets of rows and the columns from `begin` to `end`; each packet's even and odd
/// columns are summed apart where there are too few packets to hide how long a product takes.
template <int kPackets>
void add_product(const float* weights, Index rows, const float* x, Index begin, Index end,
                 float* y) noexcept {
    namespace e = Eigen::internal;
    constexpr int kParts = kPackets >= 8 ? 1 : 2;
    Packet sums[kParts][kPackets];
    for (int p = 0; p < kPackets; ++p) {
        sums[0][p] = e::ploadu<Packet>(y + p * kLanes);
        for (int part = 1; part < kParts; ++part) sums[part][p] = e::pset1<Packet>(0.0F);
    }
    Index column = begin;
    for (; column + kParts <= end; column += kParts)
        for (int part = 0; part < kParts; ++part) {
            const Packet factor = e::pset1<Packet>(x[column + part]);
            const float* of = weights + (column + part) * rows;
            for (int p = 0; p < kPackets; ++p)
                sums[part][p] = e::pmadd(e::ploadu<Packet>(of + p * kLanes), factor, sums[part][p]);
        }
    for (; column < end; ++column)
        for (int p = 0; p < kPackets; ++p)
            sums[0][p] = e::pmadd(e::ploadu<Packet>(weights + column * rows + p * kLanes),
                                  e::pset1<Packet>(x[column]), sums[0][p]);
    for (int p = 0; p < kPackets; ++p) {
        for (int part = 1; part < kParts; ++part) sums[0][p] = e::padd(sums[0][p], sums[part][p]);
        e::pstoreu(y + p * kLanes, sums[0][p]);
    }
}

void add_product(const PathModel::Layer& layer, const float* x, Index begin, Index end, float* y) noexcept {
    const Index rows = layer.weights.rows();
    const float* weights = layer.weights.data();
    Index row = 0;
    for (; row + 8 * kLanes <= rows; row += 8 * kLanes)
        add_product<8>(weights + row, rows, x, begin, end, y + row);
    if (row + 4 * kLanes <= rows)
        add_product<4>(weights + row, rows, x, begin, end, y + row), row += 4 * kLanes;
    for (; row < rows; row += kLanes) add_product<1>(weights + row, rows, x, begin, end, y + row);
}

}  // namespace

Network::Network(const PathModel& model)
    : first_(padded(model.layers[0], 0, model.layers[0].weights.rows())),
      second_(padded(model.layers[1], 0, model.layers[1].weights.rows())),
      means_(padded(model.layers[2], 0, kPathMeans)),
      spreads_(padded(model.layers[2], kPathMeans, kPathSpreads)),
      units_(model.layers[1].weights.rows()) {}

void Network::find_hidden(const StickHistory::Inputs& inputs, Hidden& hidden) const noexcept {
    Hidden first = first_.bias;
    add_product(first_, inputs.data(), 0, kFirstOfShaft, first.data());
    const bool directed = inputs[kAfterShaft - 1] != 0;
    add_product(first_, inputs.data(), directed ? kFirstOfShaft : kAfterShaft, inputs.size(), first.data());
    first = first.cwiseMax(kLeak * first);
    hidden = second_.bias;
    add_product(second_, first.data(), 0, second_.weights.cols(), hidden.data());
    hidden = hidden.cwiseMax(kLeak * hidden);
}

PathMeans Network::means(const Hidden& hidden) const noexcept {
    Hidden outputs = means_.bias;
    add_product(means_, hidden.data(), 0, units_, outputs.data());
    return outputs.head<kPathMeans>();
}

PathSpreads Network::spreads(const Hidden& hidden) const noexcept {
    Hidden outputs = spreads_.bias;
    add_product(spreads_, hidden.data(), 0, units_, outputs.data());
    return outputs.head<kPathSpreads>();
}

void Network::set_means(const Eigen::Ref<const Eigen::MatrixXf>& weights,
                        const Eigen::Ref<const Eigen::VectorXf>& bias) noexcept {
    means_.weights.topRows<kPathMeans>() = weights;
    means_.bias.head<kPathMeans>() = bias;
}

}  // namespace tracking
