#include "shared/coordinator.h"

#include <algorithm>
#include <utility>

#include "shared/initial_partition.h"
#include "shared/nearness.h"

namespace sim {
namespace {

constexpr std::uint64_t kConsolidateEvery = 2;  // steps

}  // namespace

// A record of 128 modes has 2163 bytes, an impulse between two bodies 33, the number of a constraint that
// broke 4.
std::int64_t largest_message(const WorldScene& scene) {
    constexpr std::size_t kRest = 1 << 20, kBody = 8192, kConstraint = 8, kLargest = 256 << 20;
    const std::size_t bodies = scene.world.bodies.size() + scene.later.size();
    return static_cast<std::int64_t>(
        std::min(kLargest, kRest + kBody * bodies + kConstraint * scene.world.constraints.size()));
}

Coordinator::Bytes Coordinator::shared(std::span<const std::uint8_t> bytes) {
    return std::make_shared<const std::vector<std::uint8_t>>(bytes.begin(), bytes.end());
}

std::string Coordinator::name(std::uint32_t worker) {
    return "worker " + std::to_string(worker);
}

Coordinator::Coordinator(const WorldScene& scene, const DistributedSettings& settings,
                         DistributedObserver& observer)
    : scene_(scene),
      settings_(settings),
      observer_(&observer),
      view_(scene),
      columns_(scene),
      structures_(scene, columns_.side(), structure_outlook(settings.bound, scene.world.settings.dt)),
      groups_(tied_groups(scene)),
      check_(with_later(scene), scene.world.constraints.size(), settings.steps) {
    const SharedWorld all = with_later(scene);
    for (int i = 0; i < all.bodies(); ++i)
        bodies_.push_back({kApplication, view_.clock().born(i), all.record(i), 0});
    result_.one_owner =
        !are_alike(all, groups_, structures(view_.world(), existing_bodies(), columns_.side()));
    if (result_.one_owner) settings_.market.trade = false;
}

void Coordinator::send(std::vector<std::uint32_t> to, const WorkerMessage& message) {
    if (to.empty()) return;
    const std::vector<std::uint8_t> bytes = encode({kApplication, epoch_, view_.step()}, message);
    queue_.push_back({std::move(to), shared(bytes)});
}

std::vector<Coordinator::Outgoing> Coordinator::outgoing() {
    for (const std::uint32_t worker : std::exchange(gone_, {}))
        senders_[worker].decoded = {}, senders_[worker].sent = {};
    return std::exchange(queue_, {});
}

bool Coordinator::is_member(std::uint32_t worker) const {
    return std::find(members_.begin(), members_.end(), worker) != members_.end();
}

bool Coordinator::owns(std::uint32_t worker, std::uint32_t body) const {
    return body < bodies_.size() && bodies_[body].owner == worker;
}

std::vector<int> Coordinator::owned_by(std::uint32_t worker) const {
    std::vector<int> owned;
    for (int i = 0; i < static_cast<int>(bodies_.size()); ++i)
        if (view_.clock().moves(i) && owner(i) == worker) owned.push_back(i);
    return owned;
}

// Joining and first owners.

std::uint32_t Coordinator::join(const JoinRequest& request) {
    const std::uint32_t worker = next_worker_++;
    send({worker}, SceneMessage{worker, scene_, settings_});
    observer_->note(name(worker) + " joins" + (request.host.empty() ? "" : " from " + request.host));
    members_.push_back(worker);
    most_members_ = std::max(most_members_, members_.size());
    result_.workers = std::max(result_.workers, static_cast<int>(members_.size()));
    if (finished_) {
        send({worker}, EndOfRun{});
    } else if (started_) {
        send_history(worker);
        ++epoch_;
        send(members_, Members{members_, true});
        while (!orphans_.empty()) {
            const auto orphans = std::move(orphans_.back());
            orphans_.pop_back();
            distribute(orphans.second, orphans.first);
        }
        send(members_, Members{members_});
    }
    return worker;
}

// Sends what happened up to the view's step, then the owners.
void Coordinator::send_history(std::uint32_t worker) {
    PastMessage past{{}, {sales_.begin(), sales_.end()}};
    for (std::size_t c = 0; c < scene_.world.constraints.size(); ++c)
        if (!view_.world().constraint_holds(static_cast<int>(c)))
            past.broken.push_back(static_cast<std::uint32_t>(c));
    send({worker}, past);
    std::vector<int> all;
    for (int i = 0; i < static_cast<int>(bodies_.size()); ++i)
        if (view_.clock().moves(i) && owner(i) != kApplication) all.push_back(i);
    for (const Group& group : by_owner(all)) send({worker}, ownership(group));
}

void Coordinator::start() {
    started_ = true;
    observer_->at(view_.step(), view_.world());
    begin_next_step();
    send(members_, Members{members_, true});
    if (members_.empty()) {  // all were lost before the start: the next worker that joins gets everything
        std::vector<int> all;
        for (const std::vector<int>& group : groups_) all.insert(all.end(), group.begin(), group.end());
        std::ranges::sort(all);
        orphans_.emplace_back(kApplication, std::move(all));
    } else {
        const std::vector<std::uint32_t> staying = staying_members(),
                                         &owners = staying.empty() ? members_ : staying;
        const int workers = settings_.all_to_first ? 1 : static_cast<int>(owners.size());
        const std::vector<std::vector<int>> groups = whole_groups();
        const std::vector<int> first = first_owners(columns_, groups, places(groups), workers);
        std::vector<std::vector<int>> bodies(owners.size());
        for (std::size_t i = 0; i < groups.size(); ++i) {
            auto& share = bodies[static_cast<std::size_t>(first[i])];
            share.insert(share.end(), groups[i].begin(), groups[i].end());
        }
        for (std::size_t i = 0; i < owners.size(); ++i) register_owner(bodies[i], owners[i], kApplication);
    }
    send(members_, Members{members_});
    advance();
}

// The register.

std::vector<Coordinator::Group> Coordinator::by_owner(const std::vector<int>& bodies) const {
    std::vector<Group> groups;
    for (const int body : bodies) {
        const Body& b = bodies_[static_cast<std::size_t>(body)];
        auto same = [&b](const Group& g) { return g.owner == b.owner && g.step == b.step; };
        const auto found = std::find_if(groups.begin(), groups.end(), same);
        if (found == groups.end()) {
            groups.push_back({b.owner, b.step, {body}});
        } else {
            found->bodies.push_back(body);
        }
    }
    // A worker that owned nothing begins at the step of the first group.
    std::sort(groups.begin(), groups.end(), [](const Group& a, const Group& b) {
        return std::pair(a.step, a.bodies.front()) < std::pair(b.step, b.bodies.front());
    });
    return groups;
}

Ownership Coordinator::ownership(const Group& group) const {
    Ownership message;
    message.owner = group.owner;
    message.step = group.step;
    for (const int body : group.bodies)
        message.bodies.push_back(bodies_[static_cast<std::size_t>(body)].record);
    return message;
}

void Coordinator::register_owner(const std::vector<int>& bodies, std::uint32_t owner, std::uint32_t from,
                                 bool traded) {
    for (const int body : bodies) bodies_[static_cast<std::size_t>(body)].owner = owner;
    for (const Group& group : by_owner(bodies)) {
        ++epoch_;
        for (const int body : group.bodies) {
            Body& b = bodies_[static_cast<std::size_t>(body)];
            b.epoch = epoch_, b.asked_to = kApplication;
        }
        if (owner != kApplication)
            senders_[owner].gained_at = std::max(senders_[owner].gained_at, group.step);
        Ownership message = ownership(group);
        message.from = from;
        message.traded = traded;
        if (from != kApplication) {
            while (!sales_.empty() &&
                   sales_.front().step + static_cast<std::uint64_t>(kept_steps(settings_.bound)) <
                       view_.step())
                sales_.pop_front();
            for (const int body : group.bodies)
                if (from != owner) sales_.push_back({static_cast<std::uint32_t>(body), from, group.step});
            std::vector<std::uint32_t> others = members_;
            std::erase(others, owner);
            send(std::move(others), message);
            add_surroundings(message);
            send({owner}, message);
        } else {
            send(members_, message);
        }
        observer_->moved(group.step, static_cast<int>(group.bodies.size()),
                         from == kApplication ? -1 : static_cast<int>(from), static_cast<int>(owner));
    }
}

// Adds others' bodies near these for their new owner, which received only bodies near its former ones.
void Coordinator::add_surroundings(Ownership& message) const {
    const WorldSettings& settings = scene_.world.settings;
    const double time =
        std::max(near_steps(settings_.bound) * settings.dt, structure_outlook(settings_.bound, settings.dt));
    const Outlook outlook{time, settings.dt, settings.gravity.norm()};
    const double radius = kWidest * columns_.side();
    const Reach reach = reach_of(message.bodies, radius, outlook);
    for (int i = 0; i < view_.world().bodies() && !reach.box.isEmpty(); ++i) {
        const Body& body = bodies_[static_cast<std::size_t>(i)];
        if (!view_.clock().moves(i) || body.owner == message.owner) continue;
        const Eigen::AlignedBox3f box = box_of_way(body.record.state, radius, outlook);
        if (box.isEmpty() || !meets(box, reach)) continue;
        message.around.push_back(body.record);
        message.around_step.push_back(body.step);
    }
}

std::vector<int> Coordinator::existing_bodies() const {
    std::vector<int> bodies;
    for (int i = 0; i < view_.world().bodies(); ++i)
        if (view_.clock().moves_at(i, view_.step())) bodies.push_back(i);
    return bodies;
}

// Groups of bodies that need one owner: tied bodies, joined by structures.
std::vector<std::vector<int>> Coordinator::whole_groups() const {
    std::vector<int> first(groups_.size());
    if (!result_.one_owner) first = joined_by(structures_.all(view_.world(), existing_bodies()), groups_);
    std::vector<std::vector<int>> groups(groups_.size());
    for (std::size_t i = 0; i < groups_.size(); ++i) {
        std::vector<int>& group = groups[static_cast<std::size_t>(first[i])];
        group.insert(group.end(), groups_[i].begin(), groups_[i].end());
    }
    std::erase_if(groups, [](const std::vector<int>& group) { return group.empty(); });
    return groups;
}

// Mean position of each group.
std::vector<Eigen::Vector3d> Coordinator::places(const std::vector<std::vector<int>>& groups) const {
    std::vector<Eigen::Vector3d> places;
    for (const std::vector<int>& group : groups) {
        Eigen::Vector3d sum = Eigen::Vector3d::Zero();
        for (const int body : group) sum += bodies_[static_cast<std::size_t>(body)].record.state.position;
        places.emplace_back(sum / static_cast<double>(group.size()));
    }
    return places;
}

// Neighbouring columns go to the worker with the fewest bodies until it has its share, then to the next.
std::map<std::uint32_t, std::vector<int>> Coordinator::plan_distribution(
    const std::vector<int>& bodies, const std::vector<std::uint32_t>& workers) const {
    std::map<std::uint32_t, std::size_t> count;
    std::size_t all = bodies.size();
    for (const std::uint32_t worker : workers) all += count[worker] = owned_by(worker).size();
    const std::vector<std::vector<int>> groups = whole_groups();
    const std::vector<Eigen::Vector3d> all_places = places(groups);
    const std::vector<std::optional<Eigen::Vector3d>> where(all_places.begin(), all_places.end());
    std::vector<std::optional<Column>> column(groups.size());
    columns_.assign(where, column);
    std::map<Column, std::vector<int>> by_column;
    for (std::size_t i = 0; i < groups.size(); ++i)
        for (const int body : groups[i])
            if (std::ranges::binary_search(bodies, body)) by_column[*column[i]].push_back(body);
    std::map<std::uint32_t, std::vector<int>> plan;
    const auto bodies_of = [](const auto& c) { return c.second; };
    auto to = count.end();
    for (const auto& [at, some] : by_column) {
        if (to == count.end() || to->second * workers.size() >= all)
            to = result_.one_owner ? std::ranges::max_element(count, {}, bodies_of)
                                   : std::ranges::min_element(count, {}, bodies_of);
        to->second += some.size();
        auto& share = plan[to->first];
        share.insert(share.end(), some.begin(), some.end());
    }
    return plan;
}

void Coordinator::distribute(const std::vector<int>& bodies, std::uint32_t from) {
    for (const int body : bodies) bodies_[static_cast<std::size_t>(body)].owner = kApplication;
    if (members_.empty()) {
        if (!bodies.empty()) orphans_.emplace_back(from, bodies);
        return;
    }
    const std::vector<std::uint32_t> others = staying_members();
    for (const auto& [worker, share] : plan_distribution(bodies, others.empty() ? members_ : others))
        register_owner(share, worker, from);
}

// Members that do not want to leave. If all of several do, the last one stays longest.
std::vector<std::uint32_t> Coordinator::staying_members() const {
    std::vector<std::uint32_t> workers;
    std::ranges::copy_if(members_, std::back_inserter(workers),
                         [this](std::uint32_t worker) { return !leaving_.contains(worker); });
    if (workers.empty() && members_.size() > 1) workers.push_back(members_.back());
    return workers;
}

void Coordinator::remove(std::uint32_t worker) {
    std::erase(members_, worker);
    leaving_.erase(worker);
    std::erase_if(awaited_,
                  [worker](const auto& w) { return w.first.first == worker || w.first.second == worker; });
    for (Body& body : bodies_)
        if (body.asked_to == worker) body.asked_at = 0, body.asked_to = kApplication;
    gone_.push_back(worker);
    if (started_) send(members_, Members{members_, true});
    distribute(owned_by(worker), worker);
    if (started_) send(members_, Members{members_});
    ask_leaving_members();
    advance();
}

void Coordinator::lose(std::uint32_t worker, const std::string& why) {
    if (!is_member(worker)) return;
    observer_->note(name(worker) + " is lost: " + why);
    ++result_.lost;
    result_.bodies_reowned += static_cast<int>(owned_by(worker).size());
    send({worker}, Refusal{why});
    remove(worker);
}

void Coordinator::note_waiting() {
    for (auto& [pair, for_long] : awaited_) for_long = true;
}

// Whether a member has sent another one the border data of all steps that it has published.
bool Coordinator::has_sent_all(std::uint32_t worker, std::uint32_t other) {
    Sender& sender = senders_[worker];
    return sender.sent[other] >= sender.step;
}

void Coordinator::lose_slowest(const std::string& why) {
    const Body* oldest = nullptr;
    for (int i = 0; i < static_cast<int>(bodies_.size()); ++i) {
        const Body& body = bodies_[static_cast<std::size_t>(i)];
        if (view_.clock().moves(i) && is_member(body.owner) && !senders_[body.owner].settled &&
            (!oldest || body.step < oldest->step))
            oldest = &body;
    }
    if (!oldest) return;
    std::uint32_t worker = oldest->owner;
    for (std::set<std::uint32_t> seen = {worker};;) {
        const auto next = std::ranges::find_if(members_, [&](std::uint32_t to) {
            if (seen.contains(to)) return false;
            const auto sale = awaited_.find({worker, to});
            // The seller may itself wait for border data of the buyer.
            return !has_sent_all(to, worker) ||
                   (sale != awaited_.end() && sale->second && has_sent_all(worker, to));
        });
        if (next == members_.end()) break;
        worker = *next;
        seen.insert(worker);
    }
    lose(worker, why);
}

// The view.

void Coordinator::advance() {
    while (started_ && !finished_) {
        if (settings_.until_rest && view_.at_rest()) return end(true);
        if (view_.step() >= settings_.steps) return end(false);
        release_settled();
        if (!view_.advance()) return;
        consolidate_structures(), ask_leaving_members();
        observer_->at(view_.step(), view_.world());
        begin_next_step();
    }
}

void Coordinator::begin_next_step() {
    if (view_.step() < settings_.steps) view_.begin();
    observer_->ready(view_.step(), view_.world());
}

// Asks the owners of a flat structure to give their bodies to the worker that owns most of it. Balls rest as
// well with several owners.
void Coordinator::consolidate_structures() {
    if (result_.one_owner || members_.size() < 2 || view_.step() % kConsolidateEvery != 0) return;
    const std::vector<std::vector<int>> found = structures_.flat(view_.world(), existing_bodies());
    if (found.empty()) return;
    const std::vector<int> first = joined_by(found, groups_);
    std::map<int, std::map<std::uint32_t, std::vector<std::uint32_t>>> owners;  // structures, owners, bodies
    for (std::size_t i = 0; i < groups_.size(); ++i)
        for (const int body : groups_[i])
            owners[first[i]][owner(body)].push_back(static_cast<std::uint32_t>(body));
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::vector<std::uint32_t>> asked;  // from, to
    for (const auto& [structure, shares] : owners) {
        if (shares.size() < 2) continue;
        const auto most =
            std::ranges::max_element(shares, {}, [](const auto& share) { return share.second.size(); });
        if (!is_member(most->first) || leaving_.contains(most->first)) continue;
        for (const auto& [from, bodies] : shares)
            if (from != most->first && is_member(from))
                std::ranges::copy_if(bodies, std::back_inserter(asked[{from, most->first}]),
                                     [&](std::uint32_t body) { return mark_asked(body, most->first); });
    }
    for (auto& [pair, bodies] : asked)
        if (!bodies.empty()) send({pair.first}, Gather{pair.second, std::move(bodies)});
}

// Asks members that want to leave for all their bodies. If no other member stays, it hands them over to the
// application.
void Coordinator::ask_leaving_members() {
    const std::vector<std::uint32_t> others = staying_members();
    for (const std::uint32_t worker : leaving_) {
        if (others.empty()) {
            send({worker}, Gather{kApplication, {}});
            continue;
        }
        if (worker == others.back()) continue;
        for (const auto& [to, share] : plan_distribution(owned_by(worker), others)) {
            Gather asked{to, {}};
            for (const int body : share)
                if (mark_asked(static_cast<std::uint32_t>(body), to))
                    asked.bodies.push_back(static_cast<std::uint32_t>(body));
            if (!asked.bodies.empty()) send({worker}, asked);
        }
    }
}

// Whether to ask for a body now: not if that was done some steps ago, as a sale takes some steps.
bool Coordinator::mark_asked(std::uint32_t body, std::uint32_t to) {
    Body& b = bodies_[body];
    if (!view_.clock().moves_at(static_cast<int>(body), view_.step()) ||
        (b.asked_at > 0 && view_.step() < b.asked_at + gather_patience(settings_.bound)))
        return false;
    b.asked_at = view_.step(), b.asked_to = to;
    return true;
}

// A worker that has published the last step again publishes nothing more. The view need not wait for bodies
// that it got after that.
void Coordinator::release_settled() {
    for (int i = 0; i < static_cast<int>(bodies_.size()); ++i) {
        const auto sender = senders_.find(owner(i));
        if (sender == senders_.end() || !sender->second.settled) continue;
        const Body& body = bodies_[static_cast<std::size_t>(i)];
        if (body.step == settings_.steps) view_.add(body.step, {body.record});
        view_.release(i);
    }
}

void Coordinator::end(bool rest) {
    finished_ = true;
    result_.steps = view_.step();
    result_.rest_reached = rest;
    result_.counts = view_.world().counts();
    list_mishaps(result_);
    for (const auto& [worker, impulse] : outside_) result_.outside_impulse += impulse;
    send(members_, EndOfRun{});
}

// Lists the mishaps of steps that all bodies have done, in order of steps.
void Coordinator::list_mishaps(DistributedResult& result) const {
    const auto in_order = [&](const auto& a, const auto& b) { return a.step < b.step; };
    for (const auto& [body, q] : quarantined_)
        if (q.step <= result.steps) result.quarantined.push_back(q);
    std::stable_sort(result.quarantined.begin(), result.quarantined.end(), in_order);
    for (const auto& [reported, listed] :
         {std::pair(&limited_, &result.limited), std::pair(&broken_, &result.broken)}) {
        for (const auto& [number, step] : *reported)
            if (step <= result.steps) listed->push_back({number, step});
        std::stable_sort(listed->begin(), listed->end(), in_order);
    }
}

}  // namespace sim
