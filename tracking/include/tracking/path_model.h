#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tracking/trust.h"

namespace tracking {

/// Where a model comes from: words and lines of text.
using Provenance = std::vector<std::pair<std::string, std::string>>;

/// A network that says where a stick goes, from its last 0.25 s: predictor `learned`.
///
///   x  88 inputs, h1 = f(W1 x + b1), h2 = f(W2 h1 + b2), y = W3 h2 + b3 65 outputs, f(z) = max(z, z / 10)
///
/// Vectors are in axes that turn with the motion: forward (horizontal, along the principal direction of the recent
/// motion, towards where the shaft points), up, across; lengths and speeds are over the RMS speed v of the last
/// 0.25 s [m/s], so that outputs of length are in s.
///
///   x  13 mean velocities of the tracked point between ages up to 0.25 s, over v; 13 of a point 0.4 m along the
///      shaft relative to it; the shaft's direction; 1 if that is known; log(v / 1.5 m/s); the newest four periods
///      between samples [1/60 s]; the part of the 0.25 s that samples cover              (StickHistory)
///   y  for each of the leads 1/60, 1/30, 1/15, 1/10 and 0.15 s: what is added to the position and to 0.4 m of the
///      shaft's direction after velocities that fade at 8 /s, over v [s]; then for each lead the seven numbers of
///      the errors' distribution                                           (kPathLeads, ErrorShape)
///
/// A model of other sizes does not exist: the reader refuses it.
struct PathModel {
    /// Counted up with each change of the inputs, of the outputs or of the file.
    static constexpr int kVersion = 1;
    static constexpr std::size_t kLeastHidden = 4, kMostHidden = 128;

    struct Layer {
        Eigen::MatrixXf weights;  ///< outputs x inputs
        Eigen::VectorXf bias;
    };
    using Layers = std::array<Layer, 3>;
    Layers layers;
    /// The network that says when a tip meets a plane (contact_times()); none where it was not learned.
    std::optional<Layers> contacts;
    /// What it was saved with after a performance; none of a model that was trained. Each stick once.
    std::vector<Trust> trust = {};
    /// Where it comes from: (key, value), each on one line; keys are words.
    Provenance provenance;
};

/// The file: a head of lines of text, an empty line, then the weights.
///
///   MusicWorld path model 1
///   KEY: VALUE                      the provenance, any number of lines
///   sizes: INPUTS HIDDEN1 HIDDEN2 OUTPUTS
///   contacts: INPUTS HIDDEN1 HIDDEN2 OUTPUTS     of the network of contacts, if there is one
///   trust: STICK                    for each stick that it was saved with, by the name
///   checksum: 16 hex digits         FNV-1a 64 of all bytes before this line and of the weights
///   (empty)
///   W1, b1, W2, b2, W3, b3 (and of the network of contacts likewise)   IEEE floats of 4 bytes, little-endian, matrices by columns
///   for each trust the numbers of Trust::leads in their order           IEEE floats of 8 bytes
///
/// `head -n 20 FILE` shows where a model comes from. parse_path_model(format_path_model(m)) is m to the bit.
/// Throws std::invalid_argument for provenance that the format cannot hold, as check_provenance does, and for a stick's
/// name that is no word.
[[nodiscard]] std::string format_path_model(const PathModel& model);
void check_provenance(const Provenance& provenance);

/// Throws TraceError with FILE:LINE or FILE:byte N, what was found and expected, for anything else than a whole
/// and finite model of this version and these sizes, with numbers of trust that can have been learned; `name` stands for
/// the file. (Fuzzed.)
[[nodiscard]] PathModel parse_path_model(std::string_view bytes, const std::string& name);
[[nodiscard]] PathModel read_path_model(const std::filesystem::path& file);

}  // namespace tracking
