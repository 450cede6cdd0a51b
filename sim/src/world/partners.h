#pragma once
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

namespace sim {

/// A step that was begun together is not finished so. Whoever gets this does the step alone: that needs nobody else, and has
/// the same bits.
struct NotTogether : std::runtime_error {
    using std::runtime_error::runtime_error;
};

/// Those who do one step of one world together (World::step_together), each with the whole world in its own memory. All
/// begin it with the same bits, and know alike who does what, so messages need no names: what is told is heard in the order
/// of telling.
class Partners {
public:
    using Bytes = std::vector<std::uint8_t>;

    /// Number of this one, -1 of who only listens, and who finds the contacts of each body; of further bodies the first does.
    Partners(int self, int count, std::vector<int> of) : self_(self), count_(count), of_(std::move(of)) {}
    virtual ~Partners() = default;
    Partners(const Partners&) = delete;
    Partners& operator=(const Partners&) = delete;

    [[nodiscard]] int self() const noexcept { return self_; }
    [[nodiscard]] int count() const noexcept { return count_; }
    [[nodiscard]] int of(int body) const noexcept {
        return static_cast<std::size_t>(body) < of_.size() ? of_[static_cast<std::size_t>(body)] : 0;
    }
    virtual void tell(int partner, Bytes&& bytes) = 0;
    virtual void tell_all(Bytes&& bytes) = 0;  ///< the others; who only listens tells nothing
    /// The next of what this partner told; waits for it. Throws NotTogether if it does not come.
    [[nodiscard]] virtual Bytes hear(int partner) = 0;

private:
    int self_, count_;
    std::vector<int> of_;
};

}  // namespace sim
