#pragma once
#include <stdlib.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

/// A file in memory for decoders that open theirs.
class WrittenInput {
public:
    /// With a name that ends as asked for, in a folder of its own.
    explicit WrittenInput(const std::string& name) : folder_(make_folder()), file_(folder_ / name) {}
    ~WrittenInput() {
        std::error_code none;
        std::filesystem::remove_all(folder_, none);
    }
    WrittenInput(const WrittenInput&) = delete;
    WrittenInput& operator=(const WrittenInput&) = delete;

    [[nodiscard]] const std::filesystem::path& with(std::string_view bytes) const {
        write(file_, bytes);
        return file_;
    }
    void beside(const std::string& name, std::string_view bytes) const { write(folder_ / name, bytes); }
    [[nodiscard]] std::string folder() const { return folder_.string(); }

private:
    static std::filesystem::path make_folder() {
        std::string name = "/dev/shm/musicworld-fuzz-XXXXXX";
        if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
        return name;
    }
    static void write(const std::filesystem::path& file, std::string_view bytes) {
        std::FILE* out = std::fopen(file.c_str(), "wb");
        if (out == nullptr || std::fwrite(bytes.data(), 1, bytes.size(), out) != bytes.size() ||
            std::fclose(out) != 0)
            throw std::runtime_error("cannot write " + file.string());
    }

    std::filesystem::path folder_, file_;
};
