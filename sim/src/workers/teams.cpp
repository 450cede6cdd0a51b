#include "workers/teams.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "messages/keyed_hash.h"

namespace sim {
namespace {

constexpr std::uint64_t kStepsKept =
    10'000;                             // by which a member may be behind the others and still be checked
constexpr int kMostMessagesAStep = 64;  // it is published again when other members are lost
constexpr std::size_t kMostWaiting = 100'000;  // states of a member, about 25 MB of hashes
constexpr std::size_t kMostBytes = 256 << 20;  // of a team's waiting states

}  // namespace

Teams::Teams(Coordinator& meeting, int size, DistributedObserver& observer)
    : meeting_(meeting), size_(static_cast<std::size_t>(size)), observer_(observer) {}

std::optional<std::uint32_t> Teams::join(const JoinRequest& request) {
    if (size_ > 1 && started_) return std::nullopt;
    auto team = std::find_if(teams_.begin(), teams_.end(),
                             [this](const auto& t) { return t.second.members.size() < size_; });
    if (team == teams_.end()) team = teams_.try_emplace(meeting_.join(request)).first;
    const std::uint32_t member = size_ == 1 ? team->first : next_++;
    if (size_ > 1)
        observer_.note("member " + std::to_string(member) + " is of worker " + std::to_string(team->first));
    team->second.members.try_emplace(member);
    team_of_[member] = team->first;
    most_ = std::max(most_, team_of_.size());
    for (const auto& bytes : team->second.heard) queue_.push_back({{member}, bytes});
    return member;
}

void Teams::start() {
    started_ = true;
    for (auto& [number, team] : teams_) {
        team.heard.clear();
        if (size_ > 1 && team.members.size() < 2) meeting_.lose(number, "no other member checks it");
    }
    meeting_.start();
}

void Teams::address(Coordinator::Outgoing& out) {
    std::vector<std::uint32_t> members;
    for (const std::uint32_t number : out.to) {
        const auto found = teams_.find(number);
        if (found == teams_.end()) continue;
        for (const auto& [member, waiting] : found->second.members) members.push_back(member);
        if (size_ > 1 && !started_) found->second.heard.push_back(out.bytes);
    }
    out.to = std::move(members);
}

std::vector<Coordinator::Outgoing> Teams::outgoing() {
    lost_ += static_cast<int>(std::erase_if(team_of_, [this](const auto& m) { return is_lost(m.second); }));
    std::erase_if(teams_, [this](const auto& t) { return is_lost(t.first); });
    return std::exchange(queue_, {});
}

bool Teams::is_lost(std::uint32_t number) const {
    const std::vector<std::uint32_t>& there = meeting_.members();
    return std::find(there.begin(), there.end(), number) == there.end();
}

void Teams::take(std::uint32_t member, const std::vector<std::uint8_t>& bytes) {
    const auto found = team_of_.find(member);
    if (found == team_of_.end() || is_lost(found->second)) return;
    const std::uint32_t number = found->second;
    if (size_ == 1) return meeting_.take(number, bytes);
    try {
        take_checked(member, number, bytes);
    } catch (const DecodeError& error) {
        give_up(member, error.what());
    }
}

void Teams::take_checked(std::uint32_t member, std::uint32_t number, const std::vector<std::uint8_t>& bytes) {
    DecodedMessage m = decode_message(bytes);
    if (std::holds_alternative<Drained>(m.message)) {
        observer_.note("member " + std::to_string(member) + " leaves");
        ++left_;
        return remove(member);
    }
    if (const auto* failure = std::get_if<WorkerFailure>(&m.message)) return give_up(member, failure->what);
    auto* state = std::get_if<StateMessage>(&m.message);
    if (!state) return;  // what it would hand over or sell is its team's
    if (m.header.worker != number) return give_up(member, "found another worker's number");
    if (m.header.step + kStepsKept <= meeting_.steps()) return;
    // What is not to be compared, or in an order that depends on what came before.
    state->report = StepReport{.mishaps = std::move(state->report.mishaps)};
    std::ranges::sort(state->bodies, {}, &WorldRecord::body);
    std::ranges::sort(state->contacts, {}, [](const ContactRecord& c) { return std::pair(c.a, c.b); });
    std::ranges::sort(state->springs, {}, &SpringRecord::constraint);
    std::vector<std::uint8_t> bodies;
    for (const WorldRecord& record : state->bodies)
        for (int shift = 0; shift < 32; shift += 8)
            bodies.push_back(static_cast<std::uint8_t>(record.body >> shift));
    const std::vector<std::uint8_t> all = encode({number, 0, m.header.step}, m.message);
    hear(member, number, m.header.step, {keyed_hash(key_, all), keyed_hash(key_, bodies)}, bytes);
}

void Teams::hear(std::uint32_t member, std::uint32_t number, std::uint64_t step, const Content& content,
                 const std::vector<std::uint8_t>& bytes) {
    Team& team = teams_.at(number);
    Step& at = team.steps[step];
    if (++at.messages[member] > kMostMessagesAStep)
        return give_up(member, "found more messages than steps need");
    for (const Content& agreed : at.agreed) {
        if (agreed == content) return;
        if (agreed.bodies == content.bodies)
            return give_up(member, "its states differ from those of the others");
    }
    auto claim = std::ranges::find(at.waiting, content, &Claim::content);
    if (claim == at.waiting.end()) claim = at.waiting.insert(claim, {content, {}, {}});
    if (std::ranges::count(claim->members, member) > 0) return;
    claim->members.push_back(member);
    if (claim->members.size() == 2 && team.bytes <= kMostBytes) {
        claim->bytes = bytes;
        team.bytes += bytes.size();
    }
    if (++team.members.at(member) > kMostWaiting)
        return give_up(member, "found more states ahead of the others than can wait");
    judge(number, step, step);
}

/// Steps that wait, in order: each member publishes them in order, so what is agreed on does not overtake.
void Teams::judge(std::uint32_t number, std::uint64_t first, std::uint64_t last) {
    Team& team = teams_.at(number);
    std::set<std::uint32_t> liars;
    std::uint64_t newest = 0;
    for (auto at = team.steps.lower_bound(first);
         at != team.steps.end() && at->first <= last && !is_lost(number); ++at) {
        const std::size_t before = at->second.agreed.size();
        agree(number, at->second, liars);
        if (at->second.agreed.size() > before) newest = at->first;
        check_majority(number, at->second);
    }
    while (!team.steps.empty() && team.steps.begin()->first + kStepsKept < newest) {
        for (const Claim& claim : team.steps.begin()->second.waiting) forget(team, claim);
        team.steps.erase(team.steps.begin());
    }
    for (const std::uint32_t liar : liars)
        if (is_member(liar)) give_up(liar, "its states differ from those of the others");
}

/// Passes on what more than half of the team say of a step.
void Teams::agree(std::uint32_t number, Step& at, std::set<std::uint32_t>& liars) {
    Team& team = teams_.at(number);
    while (!is_lost(number)) {
        const auto found = std::ranges::find_if(
            at.waiting, [&](const Claim& claim) { return 2 * claim.members.size() > team.members.size(); });
        if (found == at.waiting.end()) return;
        const Claim agreed = *found;
        std::erase_if(at.waiting, [&](const Claim& claim) {
            if (claim.content.bodies != agreed.content.bodies) return false;
            if (claim.content != agreed.content) liars.insert(claim.members.begin(), claim.members.end());
            forget(team, claim);
            return true;
        });
        at.agreed.push_back(agreed.content);
        if (agreed.bytes.empty())
            meeting_.lose(number, "more of its members' states wait for others than can be kept");
        else
            meeting_.take(number, agreed.bytes), meeting_.advance();
    }
}

/// Gives up a team of which no more than half can come to say the same of some bodies.
void Teams::check_majority(std::uint32_t number, const Step& at) {
    const std::size_t all = teams_.at(number).members.size();
    for (const Claim& claim : at.waiting) {
        std::set<std::uint32_t> spoken;
        std::size_t most = 0;
        for (const Claim& other : at.waiting) {
            if (other.content.bodies != claim.content.bodies) continue;
            spoken.insert(other.members.begin(), other.members.end());
            most = std::max(most, other.members.size());
        }
        if (2 * (most + all - spoken.size()) <= all)
            return meeting_.lose(number, "its members publish different states, and no more than half agree");
    }
}

void Teams::forget(Team& team, const Claim& claim) {
    team.bytes -= claim.bytes.size();
    for (const std::uint32_t member : claim.members) --team.members.at(member);
}

void Teams::lose(std::uint32_t member, const std::string& why) {
    const auto found = team_of_.find(member);
    if (found == team_of_.end()) return;
    if (size_ == 1) return meeting_.lose(found->second, why);
    give_up(member, why);
}

void Teams::give_up(std::uint32_t member, const std::string& why) {
    observer_.note("member " + std::to_string(member) + " is lost: " + why);
    ++lost_;
    queue_.push_back({{member}, std::make_shared<const std::vector<std::uint8_t>>(encode({}, Refusal{why}))});
    remove(member);
}

void Teams::remove(std::uint32_t member) {
    const std::uint32_t number = team_of_.at(member);
    team_of_.erase(member);
    Team& team = teams_.at(number);
    for (auto& [step, at] : team.steps) {
        at.messages.erase(member);
        std::erase_if(at.waiting, [&](Claim& claim) {
            std::erase(claim.members, member);
            if (claim.members.empty()) team.bytes -= claim.bytes.size();
            return claim.members.empty();
        });
    }
    team.members.erase(member);
    if (is_lost(number)) return;
    if (team.members.size() < (started_ ? 2u : 1u))
        meeting_.lose(number, "too few of its members are left to check each other");
    else
        judge(number, 0, std::numeric_limits<std::uint64_t>::max());
}

void Teams::count(DistributedResult& result) const {
    if (size_ == 1) return;
    result.workers = static_cast<int>(most_);
    result.lost = lost_;
    result.left = left_;
}

}  // namespace sim
