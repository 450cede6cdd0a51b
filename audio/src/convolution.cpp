#include "convolution.h"

#include <fftw3.h>

#include <algorithm>
#include <mutex>

namespace audio {
namespace {

struct Free {
    void operator()(void* memory) const noexcept { fftwf_free(memory); }
};
using Buffer = std::unique_ptr<float[], Free>;

Buffer buffer(std::size_t floats) {
    Buffer made(fftwf_alloc_real(floats));
    if (!made) throw std::bad_alloc();
    std::fill_n(made.get(), floats, 0.0F);
    return made;
}

/// FFTW's planner is the process's.
std::mutex& planner() {
    static std::mutex mutex;
    return mutex;
}

/// sum += a b, of n complex numbers each.
void add_product(float* sum, const float* a, const float* b, std::size_t n) noexcept {
    for (std::size_t i = 0; i < 2 * n; i += 2) {
        sum[i] += a[i] * b[i] - a[i + 1] * b[i + 1];
        sum[i + 1] += a[i] * b[i + 1] + a[i + 1] * b[i];
    }
}

bool is_silent(std::span<const float> samples) {
    return std::ranges::all_of(samples, [](float x) { return x == 0; });
}

}  // namespace

/// A stretch of the response in partitions of `length` samples: a block of as many gives the convolution over that block.
class Convolution::Partitions {
public:
    Partitions(const ImpulseResponse& response, std::size_t begin, std::size_t end, std::size_t length,
               double gain)
        : length_(length),
          count_((end - begin + length - 1) / length),
          time_(buffer(2 * length)),
          spectrum_(buffer(2 * bins())),
          sums_{buffer(2 * bins()), buffer(2 * bins())} {
        const std::scoped_lock lock(planner());
        auto* complex = reinterpret_cast<fftwf_complex*>(spectrum_.get());
        forward_ = fftwf_plan_dft_r2c_1d(static_cast<int>(2 * length), time_.get(), complex, FFTW_ESTIMATE);
        backward_ = fftwf_plan_dft_c2r_1d(static_cast<int>(2 * length),
                                          reinterpret_cast<fftwf_complex*>(sums_[0].get()), time_.get(),
                                          FFTW_ESTIMATE);
        if (forward_ == nullptr || backward_ == nullptr) throw std::bad_alloc();
        for (std::size_t from = 0; from < 2; ++from) {
            history_[from].assign(count_ * 2 * bins(), 0);
            last_[from].assign(length, 0);
            for (std::size_t to = 0; to < 2; ++to)
                transform(std::span(response.from_to[from][to]).subspan(begin, end - begin), gain,
                          filters_[from][to]);
        }
    }
    ~Partitions() {
        const std::scoped_lock lock(planner());
        fftwf_destroy_plan(forward_);
        fftwf_destroy_plan(backward_);
    }
    Partitions(const Partitions&) = delete;
    Partitions& operator=(const Partitions&) = delete;

    /// The part `share` of `shares` of what earlier blocks give in the next one: all of them, before convolve.
    void prepare(std::size_t share, std::size_t shares) noexcept {
        const std::size_t earlier = count_ - 1, begin = 1 + earlier * share / shares,
                          end = 1 + earlier * (share + 1) / shares;
        for (std::size_t to = 0; to < 2; ++to)
            for (std::size_t from = 0; from < 2; ++from)
                for (std::size_t i = begin; i < end; ++i) add(from, to, i, (newest_ + i - 1) % count_);
    }

    /// `in`, `out`: length samples of each side; out is overwritten.
    void convolve(const std::array<std::vector<float>, 2>& in,
                  std::array<std::vector<float>, 2>& out) noexcept {
        newest_ = (newest_ + count_ - 1) % count_;
        for (std::size_t from = 0; from < 2; ++from) {
            std::ranges::copy(last_[from], time_.get());
            std::ranges::copy(in[from], time_.get() + length_);
            std::ranges::copy(in[from], last_[from].begin());
            fftwf_execute(forward_);
            std::copy_n(spectrum_.get(), 2 * bins(), &history_[from][newest_ * 2 * bins()]);
        }
        for (std::size_t to = 0; to < 2; ++to) {
            for (std::size_t from = 0; from < 2; ++from) add(from, to, 0, newest_);
            auto* sum = reinterpret_cast<fftwf_complex*>(sums_[to].get());
            fftwf_execute_dft_c2r(backward_, sum, time_.get());
            std::copy_n(time_.get() + length_, length_, out[to].begin());
            std::fill_n(sums_[to].get(), 2 * bins(), 0.0F);
        }
    }

private:
    [[nodiscard]] std::size_t bins() const { return length_ + 1; }

    /// What the block at `block` of the history gives by the filter's partition i.
    void add(std::size_t from, std::size_t to, std::size_t i, std::size_t block) noexcept {
        if (filters_[from][to].empty()) return;
        add_product(sums_[to].get(), &history_[from][block * 2 * bins()], &filters_[from][to][i * 2 * bins()],
                    bins());
    }

    /// Spectra of a response's partitions, with the transforms' scale; none for silence.
    void transform(std::span<const float> response, double gain, std::vector<float>& spectra) {
        if (is_silent(response)) return;
        spectra.resize(count_ * 2 * bins());
        const auto scale = static_cast<float>(gain / (2.0 * static_cast<double>(length_)));
        for (std::size_t i = 0; i < count_; ++i) {
            std::fill_n(time_.get(), 2 * length_, 0.0F);
            const std::size_t begin = i * length_, size = std::min(length_, response.size() - begin);
            for (std::size_t n = 0; n < size; ++n) time_[n] = scale * response[begin + n];
            fftwf_execute(forward_);
            std::copy_n(spectrum_.get(), 2 * bins(), &spectra[i * 2 * bins()]);
        }
    }

    std::size_t length_, count_;
    Buffer time_, spectrum_;
    std::array<Buffer, 2> sums_;  // of products, by the side that they are heard on
    fftwf_plan forward_ = nullptr, backward_ = nullptr;
    std::array<std::array<std::vector<float>, 2>, 2> filters_;  // spectra, a partition after the other
    std::array<std::vector<float>, 2> history_;  // spectra of what came, a ring from newest_ on
    std::array<std::vector<float>, 2> last_;     // the block before
    std::size_t newest_ = 0;
};

Convolution::Convolution(const ImpulseResponse& response, double gain, std::size_t block) : block_(block) {
    first_ = std::make_unique<Partitions>(response, 0, std::min(response.size(), kLong), block, gain);
    if (response.size() > kLong)
        rest_ = std::make_unique<Partitions>(response, kLong, response.size(), kLong, gain);
    for (std::size_t side = 0; side < 2; ++side) {
        gathered_[side].assign(kLong, 0), waiting_[side].assign(kLong, 0);
        in_[side].assign(block, 0), out_[side].assign(block, 0);
    }
}

Convolution::~Convolution() = default;

void Convolution::add_answer(std::span<const float> input, std::span<float> output) noexcept {
    for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t n = 0; n < block_; ++n)
            gathered_[side][at_ + n] = in_[side][n] = input[2 * n + side];
    first_->prepare(0, 1);
    first_->convolve(in_, out_);
    if (rest_) rest_->prepare(at_ / block_, kLong / block_);
    for (std::size_t side = 0; side < 2; ++side)
        for (std::size_t n = 0; n < block_; ++n)
            output[2 * n + side] += out_[side][n] + waiting_[side][at_ + n];
    at_ += block_;
    if (at_ < kLong) return;
    at_ = 0;
    if (rest_) rest_->convolve(gathered_, waiting_);
}

}  // namespace audio
