#pragma once
#include <map>
#include <optional>
#include <set>

#include "messages/secret.h"
#include "shared/coordinator.h"

namespace sim {

/// Members of a run in lockstep who check each other. Those of a team get the same messages and so compute the
/// same bodies, to the bit; the coordinator sees one worker. States count once more than half of the team have
/// published the same ones. A member that has published others of the same bodies is given up. A team of which
/// less than two are left, or in which no more than half agree, is given up as a whole: nobody can say then who is
/// right. What a worker reports of its times and costs is not checked, and members of a team do not trade; after
/// the start no more may join. A member that knows all other bodies may be far ahead of the rest of its team: what
/// it says is kept as a hash until a second member says the same, and then whole until more than half do. When a
/// member goes, what waits is judged again, in the order of steps.
///
/// What members may cost: one for which more than 100,000 states wait is given up; of states that two members say
/// 256 MiB and one more a team are kept.
///
/// Teams of one are what a run without such checks has: everything is passed on as it comes, and the member has
/// the coordinator's number.
class Teams {
public:
    /// `size`: of a team, at most.
    Teams(Coordinator& meeting, int size, DistributedObserver& observer);

    /// Number of a new member; none if there is no place for it.
    [[nodiscard]] std::optional<std::uint32_t> join(const JoinRequest& request);
    void start();  ///< starts the meeting
    void take(std::uint32_t member, const std::vector<std::uint8_t>& bytes);
    void lose(std::uint32_t member, const std::string& why);
    /// Turns the coordinator's numbers of a message into those of members.
    void address(Coordinator::Outgoing& out);
    /// What is to be sent besides; call it when all messages of the coordinator have been addressed: members that
    /// it has lost are members no more.
    [[nodiscard]] std::vector<Coordinator::Outgoing> outgoing();

    [[nodiscard]] bool is_member(std::uint32_t member) const { return team_of_.count(member) > 0; }
    [[nodiscard]] std::size_t members() const { return team_of_.size(); }
    /// Puts the counts of members in the place of those of teams.
    void count(DistributedResult& result) const;

private:
    /// Of a message: its hash without its report, and that of the bodies alone.
    struct Content {
        std::uint64_t all, bodies;
        bool operator==(const Content&) const = default;
    };
    /// What some members say, of which there may be more.
    struct Claim {
        Content content;
        std::vector<std::uint32_t> members;  ///< who say so
        std::vector<std::uint8_t> bytes;     ///< of its message, once two say so
    };
    struct Step {
        std::vector<Claim> waiting;             ///< not agreed on
        std::vector<Content> agreed;            ///< passed on
        std::map<std::uint32_t, int> messages;  ///< of each member
    };
    struct Team {
        std::map<std::uint32_t, std::size_t> members;  ///< and in how many waiting claims each is
        std::vector<std::shared_ptr<const std::vector<std::uint8_t>>> heard;  ///< before the start
        std::map<std::uint64_t, Step> steps;
        std::size_t bytes = 0;  ///< of waiting claims
    };

    void take_checked(std::uint32_t member, std::uint32_t number, const std::vector<std::uint8_t>& bytes);
    void hear(std::uint32_t member, std::uint32_t number, std::uint64_t step, const Content& content,
              const std::vector<std::uint8_t>& bytes);
    void judge(std::uint32_t number, std::uint64_t first, std::uint64_t last);
    void agree(std::uint32_t number, Step& at, std::set<std::uint32_t>& liars);
    void check_majority(std::uint32_t number, const Step& at);
    static void forget(Team& team, const Claim& claim);
    void give_up(std::uint32_t member, const std::string& why);
    void remove(std::uint32_t member);
    [[nodiscard]] bool is_lost(std::uint32_t number) const;

    Coordinator& meeting_;
    const std::size_t size_;
    DistributedObserver& observer_;
    std::map<std::uint32_t, Team> teams_;             ///< by the coordinator's number
    std::map<std::uint32_t, std::uint32_t> team_of_;  ///< of members
    std::vector<Coordinator::Outgoing> queue_;
    std::uint32_t next_ = 0;
    bool started_ = false;
    const Secret key_ = make_secret();  ///< of the hashes
    int lost_ = 0, left_ = 0;
    std::size_t most_ = 0;
};

}  // namespace sim
