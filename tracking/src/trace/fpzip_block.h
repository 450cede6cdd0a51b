#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace tracking {

/// A table of floats, row by row.
struct FloatTable {
    std::size_t columns = 0, rows = 0;
    std::vector<float> values;

    [[nodiscard]] double at(std::size_t row, std::size_t column) const {
        return static_cast<double>(values[row * columns + column]);
    }
};

/// Decompresses what fpzip wrote (P. Lindstrom, M. Isenburg, "Fast and Efficient Compression of
/// Floating-Point Data", 2006): an array of single precision with two dimensions, at most 2^25 values and 64
/// a byte.
///
/// libfpzip trusts its input: wrong bytes make it read and write where they like. So it runs in a child
/// process without descriptors that may compute for a limited time (0.1 s and 1 us a value) and, on x86-64
/// where the kernel has seccomp filters, do nothing else than ask for memory and end. Throws TraceError
/// (FILE:byte `at`) for what is no such array, a child that ended otherwise, or too little memory (up to 256
/// bytes a byte); std::system_error where no process can be started.
[[nodiscard]] FloatTable decompress_floats(std::string_view bytes, const std::string& file, std::size_t at);

}  // namespace tracking
