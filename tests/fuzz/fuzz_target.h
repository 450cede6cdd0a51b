#pragma once
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <string_view>

// What a decoder does with bytes that anybody may have written: it reads them or throws its own error, which the function
// catches. Whatever else is thrown, and what a sanitizer finds, is a fault.
void fuzz_c3d(std::string_view bytes);
void fuzz_drumgizmo(std::string_view bytes);
void fuzz_kit(std::string_view bytes);
void fuzz_map(std::string_view bytes);
void fuzz_mesh_stream(std::string_view bytes);
void fuzz_messages(std::string_view bytes);
void fuzz_midi(std::string_view bytes);
void fuzz_model(std::string_view bytes);
void fuzz_obj(std::string_view bytes);
void fuzz_osc(std::string_view bytes);
void fuzz_own_orchestra(std::string_view bytes);
void fuzz_pedals(std::string_view bytes);
void fuzz_recording(std::string_view bytes);
void fuzz_rows(std::string_view bytes);
void fuzz_scene(std::string_view bytes);
void fuzz_sf2(std::string_view bytes);
void fuzz_sfz(std::string_view bytes);
void fuzz_table(std::string_view bytes);
void fuzz_trace(std::string_view bytes);
void fuzz_xror(std::string_view bytes);

struct FuzzTarget {
    std::string_view name;  ///< also of its folder in corpora
    void (*fuzz)(std::string_view bytes);
};

inline constexpr FuzzTarget kFuzzTargets[] = {{"c3d", fuzz_c3d},
                                              {"drumgizmo", fuzz_drumgizmo},
                                              {"kit", fuzz_kit},
                                              {"map", fuzz_map},
                                              {"mesh_stream", fuzz_mesh_stream},
                                              {"messages", fuzz_messages},
                                              {"midi", fuzz_midi},
                                              {"model", fuzz_model},
                                              {"obj", fuzz_obj},
                                              {"osc", fuzz_osc},
                                              {"own_orchestra", fuzz_own_orchestra},
                                              {"pedals", fuzz_pedals},
                                              {"recording", fuzz_recording},
                                              {"rows", fuzz_rows},
                                              {"scene", fuzz_scene},
                                              {"sf2", fuzz_sf2},
                                              {"sfz", fuzz_sfz},
                                              {"table", fuzz_table},
                                              {"trace", fuzz_trace},
                                              {"xror", fuzz_xror}};

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
