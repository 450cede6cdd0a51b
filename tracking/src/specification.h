#pragma once
#include <map>
#include <string>

namespace tracking {

/// A predictor's name with its parameters: `name` or `name:key=value,key=value`.
class Specification {
public:
    /// Throws std::invalid_argument for text that is not of that form.
    explicit Specification(const std::string& text);

    [[nodiscard]] const std::string& name() const { return name_; }

    /// The number given for `key`, or `otherwise`; throws unless least <= number <= most. The key counts as
    /// known from here on.
    [[nodiscard]] double number(const std::string& key, double otherwise, double least, double most);
    /// The same for a whole number.
    [[nodiscard]] std::size_t whole(const std::string& key, std::size_t otherwise, std::size_t least,
                                    std::size_t most);
    /// The word given for `key`, or empty; throws unless it is `only`.
    [[nodiscard]] bool word(const std::string& key, const std::string& only);
    [[nodiscard]] bool has(const std::string& key) const { return values_.contains(key); }
    /// Throws for a key that was given and never asked for.
    void require_no_others() const;

    /// Throws std::invalid_argument: predictor 'text': found ..., expected ...
    [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

private:
    void add(const std::string& assignment);

    std::string text_;
    std::string name_;
    std::map<std::string, std::string> values_;
    std::map<std::string, bool> asked_;
};

}  // namespace tracking
