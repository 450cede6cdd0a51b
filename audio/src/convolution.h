#pragma once
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

#include "audio/performance.h"

namespace audio {

/// A recorded room's answer, sample by sample without delay: convolution by overlap-save in partitions of equal length
/// (Gardner, Efficient convolution without input-output delay, JAES 43, 1995). The first kLong samples of the response are
/// convolved in partitions of a block, the rest in partitions of kLong, whose sum is ready when it is due: what came
/// until a multiple of kLong is heard from there on. Products of spectra that came before are spread over the blocks, so that
/// the block which ends a kLong has no more to do than the newest's.
///
/// Transforms by FFTW, planned by estimate, so that a plan depends on nothing but its length. Memory is taken at
/// construction only; one thread at a time.
class Convolution {
public:
    static constexpr std::size_t kLong = 2048;

    /// `block`: a power of two up to kLong.
    Convolution(const ImpulseResponse& response, double gain, std::size_t block);
    ~Convolution();
    Convolution(const Convolution&) = delete;
    Convolution& operator=(const Convolution&) = delete;

    /// Adds the answer to a block of interleaved stereo.
    void add_answer(std::span<const float> input, std::span<float> output) noexcept;

private:
    class Partitions;
    std::size_t block_;
    std::unique_ptr<Partitions> first_, rest_;              // rest_: null for a short response
    std::array<std::vector<float>, 2> gathered_, waiting_;  // kLong of each side: what came, what is due
    std::size_t at_ = 0;                                    // of both
    std::array<std::vector<float>, 2> in_, out_;            // a block
};

}  // namespace audio
