#include "workers/teams.h"

#include <algorithm>
#include <utility>

#include "messages/keyed_hash.h"

namespace sim {
namespace {

constexpr std::uint64_t kStepsKept =
    10'000;                             // by which a member may be behind the others and still be checked
constexpr int kMostMessagesAStep = 64;  // it is repeated when other members are lost
constexpr std::size_t kMostStepsAhead = 1'000'000;

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
    team->second.members.insert(member);
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
        members.insert(members.end(), found->second.members.begin(), found->second.members.end());
        if (size_ > 1 && !started_) found->second.heard.push_back(out.bytes);
    }
    out.to = std::move(members);
}

std::vector<Coordinator::Outgoing> Teams::outgoing() {
    std::erase_if(team_of_, [this](const auto& m) { return is_lost(m.second); });
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
    DecodedWorldMessage m = decode_world(bytes);
    if (std::holds_alternative<Drained>(m.message)) {
        observer_.note("member " + std::to_string(member) + " leaves");
        ++left_;
        return remove(member);
    }
    if (const auto* failure = std::get_if<WorkerFailure>(&m.message)) return give_up(member, failure->what);
    auto* state = std::get_if<StateMessage>(&m.message);
    if (!state) return;  // what it would hand over or sell is its team's
    if (m.header.worker != number || m.header.step > meeting_.steps() + kMostStepsAhead)
        return give_up(member, "found another worker's number, or a step far ahead");
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
    judge(member, number, m.header.step, {keyed_hash(key_, all), keyed_hash(key_, bodies)}, bytes);
}

void Teams::judge(std::uint32_t member, std::uint32_t number, std::uint64_t step, const Content& content,
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
    std::size_t votes = 1;
    std::set<std::uint32_t> of_these_bodies = {member};
    std::map<std::uint64_t, std::size_t> voices;
    for (const Said& other : at.said) {
        if (other.member == member && other.content == content) return;
        votes += other.content == content;
        if (other.content.bodies != content.bodies) continue;
        of_these_bodies.insert(other.member);
        ++voices[other.content.all];
    }
    const std::size_t all = team.members.size();
    if (2 * votes > all) return agree(number, step, content, bytes);
    ++voices[content.all];
    at.said.push_back({member, content});
    const auto best = std::max_element(voices.begin(), voices.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    if (2 * (best->second + all - of_these_bodies.size()) <= all)
        meeting_.lose(number, "its members publish different states, and no more than half agree");
}

void Teams::agree(std::uint32_t number, std::uint64_t step, const Content& content,
                  const std::vector<std::uint8_t>& bytes) {
    Team& team = teams_.at(number);
    Step& at = team.steps[step];
    std::set<std::uint32_t> liars;
    for (const Said& other : at.said)
        if (other.content.bodies == content.bodies && !(other.content == content)) liars.insert(other.member);
    std::erase_if(at.said, [&](const Said& s) { return s.content.bodies == content.bodies; });
    at.agreed.push_back(content);
    std::erase_if(team.steps, [step](const auto& old) { return old.first + kStepsKept < step; });
    meeting_.take(number, bytes);
    for (const std::uint32_t liar : liars) give_up(liar, "its states differ from those of the others");
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
    team.members.erase(member);
    for (auto& [step, at] : team.steps)
        std::erase_if(at.said, [member](const Said& said) { return said.member == member; });
    const std::size_t left = team.members.size();
    if (left < (started_ ? 2u : 1u))
        meeting_.lose(number, "too few of its members are left to check each other");
}

void Teams::count(DistributedResult& result) const {
    if (size_ == 1) return;
    result.workers = static_cast<int>(most_);
    result.lost = lost_;
    result.left = left_;
}

}  // namespace sim
