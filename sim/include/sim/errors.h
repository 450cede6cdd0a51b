#pragma once
#include <stdexcept>
#include <string>

namespace sim {

/// A scene, setting, request, endpoint or key that cannot be. what() is one line without a word of whose error
/// it is: "PLACE: found FOUND, expected EXPECTED", or a sentence of its own where the operating system refused.
class InputError : public std::invalid_argument {
public:
    using std::invalid_argument::invalid_argument;
    /// `place`: the body, constraint, setting or value; empty where `found` names it.
    InputError(const std::string& place, const std::string& found, const std::string& expected)
        : std::invalid_argument((place.empty() ? "" : place + ": ") + "found " + found + ", expected " +
                                expected),
          names_place_(!place.empty()) {}
    /// Whether it is about a part of what was given, such as a body of a scene.
    [[nodiscard]] bool names_place() const noexcept { return names_place_; }

private:
    bool names_place_ = false;
};

/// Workers that cannot be started, do not join or cannot go on, or keys that cannot be written. what() is one
/// line.
class WorkerError : public std::runtime_error {
public:
    using std::runtime_error::runtime_error;
};

}  // namespace sim
