#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <string_view>

/// What a decoder does with bytes that anybody may have written: it reads them or throws its own error. Whatever else is
/// thrown ends the program, and the input is kept, as with what a sanitizer finds. Each target defines it.
void fuzz(std::string_view bytes);

/// Ends the program unless it holds.
inline void require(bool holds, const std::string& what) {
    if (holds) return;
    std::fprintf(stderr, "found %s\n", what.c_str());
    std::abort();
}

/// A fault of a file is one line with its place, what was found and what was expected.
inline void require_located(const std::exception& fault, std::string_view file) {
    const std::string_view line = fault.what();
    require(line.starts_with(file) && line.find("error: found ") != line.npos &&
                line.find(", expected ") != line.npos &&
                line.find_first_of(std::string_view("\n\r\0\x1b", 4)) == line.npos,
            "a fault that reads " + std::string(line));
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
    fuzz({reinterpret_cast<const char*>(bytes), size});
    return 0;
}
