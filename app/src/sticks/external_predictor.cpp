#include "sticks/external_predictor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <tracking/rotation.h>
#include <unistd.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "files/bad_input.h"
#include "files/file_descriptor.h"
#include "process/child_process.h"
#include "process/clock.h"

namespace app {
namespace {

[[noreturn]] void fail_system(const char* action) {
    throw std::runtime_error(cannot(action));
}

/// A file without a name, which no other child inherits.
std::FILE* memory_file() {
    const int descriptor = memfd_create("errors", MFD_CLOEXEC);
    if (descriptor < 0) fail_system("make a temporary file");
    std::FILE* file = fdopen(descriptor, "w+");
    if (!file) fail_system("open a temporary file");
    return file;
}

constexpr int kProtocol = 1;
constexpr double kFarthestM = 1e6;
constexpr double kNormSlack = 0.01;

/// Rates at the nodes from the slopes between them: of the parabola through three neighbours.
Eigen::Vector3d rate_at(std::size_t i, const std::vector<double>& steps,
                        const std::vector<Eigen::Vector3d>& slopes) {
    const std::size_t last = slopes.size();  // of the nodes
    if (last == 0) return Eigen::Vector3d::Zero();
    if (last == 1) return slopes[0];
    const std::size_t k = std::clamp<std::size_t>(i, 1, last - 1);  // the middle one of the three
    const double before = steps[k - 1], after = steps[k];
    const Eigen::Vector3d bend = (slopes[k] - slopes[k - 1]) / (before + after);  // half the acceleration
    if (i < k) return slopes[0] - before * bend;
    if (i > k) return slopes[k] + after * bend;
    return slopes[k - 1] + before * bend;
}

bool positive(const Eigen::Matrix3d& m) {
    constexpr double kRounding = 1e-12;  // of the largest entry
    const Eigen::Vector3d values =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m, Eigen::EigenvaluesOnly).eigenvalues();
    return values.minCoeff() >= -kRounding * m.cwiseAbs().maxCoeff();
}

std::vector<double> ascending(std::span<const double> leads_s) {
    std::vector<double> leads(leads_s.begin(), leads_s.end());
    std::sort(leads.begin(), leads.end());
    leads.erase(std::unique(leads.begin(), leads.end()), leads.end());
    if (leads.empty() || !(leads.front() >= 0) || !std::isfinite(leads.back()))
        throw std::invalid_argument("an external predictor needs finite leads >= 0");
    return leads;
}

/// The numbers of a line, exactly `count`. Throws std::runtime_error "found ..., expected ...".
void parse_numbers(std::string_view line, std::size_t count, std::vector<double>& numbers) {
    numbers.clear();
    const char *at = line.data(), *end = at + line.size();
    const auto is_blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
    for (at = std::find_if_not(at, end, is_blank); at != end; at = std::find_if_not(at, end, is_blank)) {
        const char* stop = std::find_if(at, end, is_blank);
        double value = 0;
        const auto [parsed, problem] = std::from_chars(at, stop, value);
        if (parsed != stop || problem != std::errc() || !std::isfinite(value))
            throw std::runtime_error(
                fmt::format("found \"{}\" as number {} of {}, expected a finite number",
                            one_line(std::string_view(at, static_cast<std::size_t>(stop - at)), 60),
                            numbers.size() + 1, count));
        numbers.push_back(value);
        at = stop;
    }
    if (numbers.size() != count)
        throw std::runtime_error(fmt::format("found {} numbers, expected {}", numbers.size(), count));
}

}  // namespace

/// A program run by `sh -c COMMAND` with which lines are exchanged: its standard input and output are one
/// socket, its standard error is kept for messages. It runs in a process group of its own; the destructor
/// ends its input, gives it kFarewellS to leave, and kills and collects what is left of it.
///
/// However this program ends, the system then kills the group (SIGKILL): the child inherits the end of a pipe
/// whose other end only this program has, and the system signals to the group when that closes (fcntl:
/// O_ASYNC, F_SETOWN, F_SETSIG). That needs no process or thread that lives on. What it does not reach: a
/// process that leaves the group, and a group in which no process keeps the inherited descriptor open.
///
/// All faults are thrown as std::runtime_error "found ..., expected ...; ...", one line.
class LineChild {
public:
    explicit LineChild(const std::string& command) : errors_(memory_file()) {
        int ends[2];
        if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) fail_system("make a socket");
        socket_ = FileDescriptor(ends[0]);
        const FileDescriptor of_child(ends[1]);
        Pipe life = make_pipe();
        pid_ = start_child({{"sh", "-c", command},
                            {},
                            of_child.get(),
                            of_child.get(),
                            fileno(errors_.get()),
                            true,
                            {life.out.get()}});
        life_ = std::move(life.in);
        // Lets the system kill the process group when the other end of this pipe closes.
        const int end = life.out.get();
        if (fcntl(end, F_SETOWN, -pid_) == 0 && fcntl(end, F_SETSIG, SIGKILL) == 0 &&
            fcntl(end, F_SETFL, O_ASYNC) == 0)
            return;
        const std::string why = cannot("tie the child's end to this program's");
        (void)collect();
        throw std::runtime_error(why);
    }
    ~LineChild() {
        shutdown(socket_.get(), SHUT_WR);
        const std::int64_t deadline_ns = monotonic_ns() + to_ns(kFarewellS);
        while (pid_ > 0 && readable_until(socket_.get(), deadline_ns) &&
               recv(socket_.get(), chunk_.data(), chunk_.size(), 0) > 0) {
        }
        if (pid_ > 0) collect();
    }
    LineChild(const LineChild&) = delete;
    LineChild& operator=(const LineChild&) = delete;

    /// Sends a line (text with its line end), waiting at most `timeout_s` for the child to make room.
    void send(std::string_view text, double timeout_s) {
        if (pid_ <= 0) throw std::runtime_error("found that the child has ended, expected it to answer");
        const std::int64_t deadline_ns = monotonic_ns() + to_ns(timeout_s);
        while (!text.empty()) {
            const ssize_t sent = ::send(socket_.get(), text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
            if (sent >= 0)
                text.remove_prefix(static_cast<std::size_t>(sent));
            else if (errno == EAGAIN)
                wait_for(POLLOUT, deadline_ns, timeout_s);
            else if (errno != EINTR)
                return;  // it has ended: receive() says how, and what it had sent before
        }
    }
    /// The next line, without its end, valid until the next call. Waits at most `timeout_s`; a second line
    /// that follows it at once is a fault.
    [[nodiscard]] std::string_view receive(double timeout_s) {
        const std::int64_t deadline_ns = monotonic_ns() + to_ns(timeout_s);
        received_.erase(0, taken_);
        taken_ = 0;
        std::size_t end = received_.find('\n');
        while (end == std::string::npos) {
            if (received_.size() > kLongestLine)
                throw std::runtime_error(
                    fmt::format("found a line of more than {} bytes, expected a short one", kLongestLine));
            wait_for(POLLIN, deadline_ns, timeout_s);
            const std::size_t before = received_.size();
            const ssize_t got = recv(socket_.get(), chunk_.data(), chunk_.size(), 0);
            if (got == 0 || (got < 0 && errno != EINTR)) fail_ended();
            received_.append(chunk_.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
            end = received_.find('\n', before);
        }
        taken_ = end + 1;
        if (taken_ < received_.size()) {
            const std::string second = received_.substr(taken_, received_.find('\n', taken_) - taken_);
            throw std::runtime_error(fmt::format(
                "found a second line, \"{}\", expected one line for each line sent", one_line(second, 60)));
        }
        return std::string_view(received_).substr(0, end);
    }

private:
    static constexpr double kFarewellS = 1;
    static constexpr std::size_t kLongestLine = std::size_t{1} << 20;
    struct CloseFile {
        void operator()(std::FILE* file) const { (void)std::fclose(file); }
    };
    /// Waits until the socket can be read (or written); throws if that takes longer than until `deadline_ns`.
    void wait_for(short event, std::int64_t deadline_ns, double timeout_s) const {
        pollfd socket{socket_.get(), event, 0};
        for (;;) {
            const int ready = poll(&socket, 1, milliseconds_until(deadline_ns));
            if (ready > 0) return;
            if (ready < 0 && errno != EINTR) fail_system("wait for the child");
            if (ready == 0)
                throw std::runtime_error(fmt::format(
                    "found {} within {} s, expected one line for each line sent; does it flush its "
                    "output?",
                    event == POLLIN ? "no whole line" : "that the child does not read", timeout_s));
        }
    }
    [[noreturn]] void fail_ended() {
        const std::optional<int> status = collect();
        const std::string words = last_words();
        throw std::runtime_error(fmt::format(
            "found the child {}{}, expected it to answer",
            status ? fmt::format("ended with status {}", *status) : std::string("closed its output"),
            words.empty() ? "" : fmt::format(" saying \"{}\"", words)));
    }
    /// Kills what is left of the child and collects it; returns how it ended by itself (as wait_for_child()).
    std::optional<int> collect() {
        // A moment to end by itself, so that its status is its own.
        constexpr int kTries = 20;
        constexpr useconds_t kPauseUs = 5000;
        siginfo_t ended{};
        bool by_itself = false;
        for (int i = 0; i < kTries; ++i) {
            (void)waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT);
            by_itself = ended.si_pid == pid_;
            if (by_itself) break;
            usleep(kPauseUs);
        }
        kill(-pid_, SIGKILL);  // the group outlives its leader until that is collected
        const int status = wait_for_child(pid_);
        pid_ = -1;
        return by_itself ? std::optional(status) : std::nullopt;
    }
    [[nodiscard]] std::string last_words() const {
        constexpr long kTail = 4096;
        std::FILE* file = errors_.get();
        if (std::fseek(file, 0, SEEK_END) != 0) return {};
        (void)std::fseek(file, -std::min(std::ftell(file), kTail), SEEK_END);
        std::string text(kTail, '\0');
        text.resize(std::fread(text.data(), 1, text.size(), file));
        text.erase(std::min(text.find_last_not_of(" \t\r\n") + 1, text.size()));
        return one_line(text.substr(text.rfind('\n') + 1));
    }

    std::unique_ptr<std::FILE, CloseFile> errors_;
    FileDescriptor life_;  // the group is killed when this closes
    FileDescriptor socket_;
    int pid_ = -1;
    std::array<char, std::size_t{1} << 16> chunk_{};
    std::string received_;
    std::size_t taken_ = 0;  // bytes of it that were handed out
};

AnswerForm parse_answer_form(std::string_view line) {
    std::istringstream text{std::string(line)};
    const std::vector<std::string> words(std::istream_iterator<std::string>(text), {});
    AnswerForm form;
    std::vector<std::string> in_order = {"position"};
    for (const auto& [name, given] : {std::pair("velocity", &form.velocity),
                                      {"orientation", &form.orientation},
                                      {"covariance", &form.covariance}})
        if ((*given = std::ranges::find(words, name) != words.end())) in_order.emplace_back(name);
    if (words != in_order)
        throw std::runtime_error(fmt::format(
            "found \"{}\", expected \"position [velocity] [orientation] [covariance]\"", one_line(line, 60)));
    return form;
}

AnswerPath::AnswerPath(std::span<const double> leads_s, const AnswerForm& form)
    : form_(form), sample_nodes_(leads_s.front() > 0 ? 1 : 0) {
    nodes_.resize(leads_s.size() + sample_nodes_);
    for (std::size_t i = 0; i < leads_s.size(); ++i) nodes_[i + sample_nodes_].lead_s = leads_s[i];
}

AnswerPath::Node AnswerPath::parse(std::size_t index, std::span<const double> numbers,
                                   const tracking::PosePrediction& sample) const {
    const auto refuse = [&](const std::string& found, const std::string& expected) {
        throw std::runtime_error(
            fmt::format("found {} at lead {} s, expected {}", found, nodes_[index].lead_s, expected));
    };
    const double* n = numbers.data() + (index - sample_nodes_) * form_.numbers();
    const auto three = [&n] {
        n += 3;
        return Eigen::Vector3d(n[-3], n[-2], n[-1]);
    };
    Node node{nodes_[index].lead_s, sample, Eigen::Matrix3d::Zero()};
    node.pose.position = three();
    if (!(node.pose.position.norm() <= kFarthestM))
        refuse(fmt::format("a position {} m away", node.pose.position.norm()), "metres, within 1000000");
    if (form_.velocity) node.pose.velocity = three();
    if (form_.orientation) {
        node.pose.orientation = Eigen::Quaterniond(n[0], n[1], n[2], n[3]);
        const double norm = node.pose.orientation.norm();
        if (!(std::abs(norm - 1) <= kNormSlack))
            refuse(fmt::format("a quaternion of norm {}", norm), "w x y z of norm 1");
        node.pose.orientation.normalize();
        n += 4;
    }
    if (form_.covariance) {
        node.covariance << n[0], n[1], n[2], n[1], n[3], n[4], n[2], n[4], n[5];
        if (!positive(node.covariance))
            refuse("a covariance with a negative variance", "xx xy xz yy yz zz of a covariance [m^2]");
    }
    return node;
}

void AnswerPath::take(const tracking::PosePrediction& sample, std::span<const double> numbers) {
    std::vector<Node> next(nodes_.size());
    for (std::size_t i = sample_nodes_; i < next.size(); ++i) next[i] = parse(i, numbers, sample);
    if (sample_nodes_ > 0) next[0] = {0, sample, next[1].covariance};
    differentiate(next);
    nodes_ = std::move(next);
    answered_ = true;
}

void AnswerPath::differentiate(std::vector<Node>& nodes) const {
    std::vector<double> steps;
    std::vector<Eigen::Vector3d> slopes, turns;
    for (std::size_t i = 1; i < nodes.size(); ++i) {
        const Node &a = nodes[i - 1], &b = nodes[i];
        steps.push_back(b.lead_s - a.lead_s);
        slopes.emplace_back((b.pose.position - a.pose.position) / steps.back());
        // The rotation vector of the shorter way, world frame.
        turns.emplace_back(tracking::logarithm(b.pose.orientation * a.pose.orientation.conjugate()) /
                           steps.back());
    }
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const bool stated = form_.velocity && i >= sample_nodes_;
        if (!stated) nodes[i].pose.velocity = rate_at(i, steps, slopes);
        nodes[i].pose.angular_velocity = rate_at(i, steps, turns);
    }
}

std::size_t AnswerPath::node_before(double lead_s) const noexcept {
    const auto after = std::ranges::upper_bound(nodes_, lead_s, {}, &Node::lead_s);
    return static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - nodes_.begin() - 1, 0));
}

tracking::PosePrediction AnswerPath::at(double lead_s) const noexcept {
    const std::size_t i = node_before(lead_s);
    const Node& a = nodes_[i];
    const double past = lead_s - a.lead_s;
    if (!(past > 0)) return a.pose;
    if (i + 1 == nodes_.size()) return tracking::pose_beyond(a.pose, past);
    return tracking::pose_between(a.pose, nodes_[i + 1].pose, nodes_[i + 1].lead_s - a.lead_s, past);
}

std::optional<tracking::PoseCovariance> AnswerPath::covariance_at(double lead_s) const noexcept {
    if (!form_.covariance || !answered_) return std::nullopt;
    const std::size_t i = node_before(lead_s);
    const Node& a = nodes_[i];
    tracking::PoseCovariance result;
    result.position = a.covariance;
    if (i + 1 < nodes_.size() && lead_s > a.lead_s) {
        const double s = (lead_s - a.lead_s) / (nodes_[i + 1].lead_s - a.lead_s);
        result.position += s * (nodes_[i + 1].covariance - a.covariance);
    }
    return result;
}

ExternalPredictor::ExternalPredictor(const std::string& command, std::span<const double> leads_s,
                                     const std::string& stick, ExternalPatience patience)
    : place_(fmt::format("exec:{}, stick {}", command, stick)),
      leads_s_(ascending(leads_s)),
      held_(tracking::make_predictor("hold")),
      patience_(patience) {
    try {
        child_ = std::make_unique<LineChild>(command);
        fmt::format_to(std::back_inserter(line_), "musicworld {} {}", kProtocol, stick);
        for (const double lead : leads_s_) fmt::format_to(std::back_inserter(line_), " {}", lead);
        line_ += '\n';
        child_->send(line_, patience_.start_s);
        path_ = AnswerPath(leads_s_, form_ = parse_answer_form(child_->receive(patience_.start_s)));
    } catch (const std::runtime_error& wrong) {
        throw std::runtime_error(fmt::format("{}, first line: error: {}", place_, wrong.what()));
    }
}

ExternalPredictor::~ExternalPredictor() = default;

tracking::SampleStatus ExternalPredictor::correct(const tracking::PoseSample& sample) noexcept {
    if (failure_) return tracking::SampleStatus::not_finite;
    const tracking::SampleStatus status = held_->correct(sample);
    if (!is_taken(status)) return status;
    try {
        exchange(sample, status == tracking::SampleStatus::reinitialised && answers_ > 0);
    } catch (...) {
        failure_ = std::current_exception();
        return tracking::SampleStatus::not_finite;
    }
    return status;
}

void ExternalPredictor::exchange(const tracking::PoseSample& sample, bool anew) {
    const Eigen::Vector3d& p = sample.position;
    const Eigen::Quaterniond& q = sample.orientation;
    line_ = anew ? "restart\n" : "";
    fmt::format_to(std::back_inserter(line_), "{} {} {} {}", sample.t_s, p.x(), p.y(), p.z());
    if (sample.has_orientation)
        fmt::format_to(std::back_inserter(line_), " {} {} {} {}", q.w(), q.x(), q.y(), q.z());
    line_ += '\n';
    ++answers_;
    try {
        child_->send(line_, patience_.answer_s);
        parse_numbers(child_->receive(patience_.answer_s), leads_s_.size() * form_.numbers(), numbers_);
        path_.take(held_->predict(0), numbers_);
    } catch (const std::runtime_error& wrong) {
        throw std::runtime_error(fmt::format("{}, answer {}: error: {}", place_, answers_, wrong.what()));
    }
}

}  // namespace app
