#include "shared/impulse_log.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sim {
namespace {

double common(double a, double b) {
    if (a * b <= 0) return 0;
    if (std::abs(a) < 2 * std::abs(b) && std::abs(b) < 2 * std::abs(a)) return (a + b) / 2;
    return std::abs(a) < std::abs(b) ? a : b;
}

void add(Eigen::VectorXd& a, const Eigen::VectorXd& b, double factor) {
    if (b.size() == 0) return;
    if (a.size() == 0) a = Eigen::VectorXd::Zero(b.size());
    a += factor * b;
}

template <typename Vector>
void common(const Vector& a, const Vector& b, Vector& c) {
    c.resize(std::min(a.size(), b.size()));
    for (Eigen::Index i = 0; i < c.size(); ++i) c[i] = common(a[i], b[i]);
}

}  // namespace

void add_impulse(StepImpulse& a, const StepImpulse& b, double factor) {
    a.linear += factor * b.linear;
    a.angular += factor * b.angular;
    a.displacement += factor * b.displacement;
    a.turn += factor * b.turn;
    add(a.modal, b.modal, factor);
    add(a.modal_q, b.modal_q, factor);
    add(a.modal_rate, b.modal_rate, factor);
}

void add_steady(StepImpulse& a, const StepImpulse& b) {
    a.linear += b.linear;
    a.angular += b.angular;
    a.displacement += b.displacement;
    a.turn += b.turn;
    add(a.modal, b.modal, 1);
}

bool is_finite(const StepImpulse& a) {
    return a.linear.allFinite() && a.angular.allFinite() && a.displacement.allFinite() &&
           a.turn.allFinite() && a.modal.allFinite() && a.modal_q.allFinite() && a.modal_rate.allFinite();
}

bool is_zero(const StepImpulse& a) {
    return a.linear.isZero(0) && a.angular.isZero(0) && a.displacement.isZero(0) && a.turn.isZero(0) &&
           a.modal.isZero(0) && a.modal_q.isZero(0) && a.modal_rate.isZero(0);
}

void lasting(const StepImpulse& a, const StepImpulse& b, StepImpulse& out) {
    common(a.linear, b.linear, out.linear);
    common(a.angular, b.angular, out.angular);
    common(a.modal, b.modal, out.modal);
    out.displacement.setZero(), out.turn.setZero();
    out.modal_q.resize(0), out.modal_rate.resize(0);
}

ImpulseLog::ImpulseLog(const World& world, int bodies, int keep_steps)
    : world_(&world),
      keep_(static_cast<std::uint64_t>(keep_steps)),
      entries_(static_cast<std::size_t>(bodies)) {}

void ImpulseLog::add(int body, std::uint32_t source, std::uint64_t step, StepImpulse impulse) {
    entries_[static_cast<std::size_t>(body)].push_back(
        {source, 0, step, nullptr, std::make_unique<StepImpulse>(std::move(impulse))});
}

void ImpulseLog::add(std::uint32_t source, std::uint64_t step,
                     const std::shared_ptr<const PackedUpdates>& message) {
    for (const PackedUpdates::Place& push : message->pushes)
        if (push.body < entries_.size())
            entries_[push.body].push_back({source, push.offset, step, message, nullptr});
}

void ImpulseLog::heard(std::uint32_t source, std::uint64_t step) {
    std::uint64_t& known = known_[source];
    known = std::max(known, step);
}

std::uint64_t ImpulseLog::known(std::uint32_t source) const {
    const auto found = known_.find(source);
    return found == known_.end() ? 0 : found->second;
}

ImpulseLog::Sources ImpulseLog::sources_of(int body, std::uint64_t since) const {
    Sources sources;
    for (const Entry& entry : entries_[static_cast<std::size_t>(body)]) {
        if (entry.step < since || std::find(sources.begin(), sources.end(), entry.source) != sources.end())
            continue;
        if (sources.count < kMostSources) sources.source[sources.count++] = entry.source;
    }
    std::sort(sources.source, sources.source + sources.count);
    return sources;
}

std::uint64_t ImpulseLog::first_after(int body, std::uint64_t step) const {
    std::uint64_t first = kForever;
    for (const Entry& entry : entries_[static_cast<std::size_t>(body)])
        if (entry.step > step) first = std::min(first, entry.step);
    return first;
}

int ImpulseLog::count_since(int body, std::uint64_t step, std::uint32_t self) const {
    const Sources sources = sources_of(body, step);
    return sources.count - static_cast<int>(std::count(sources.begin(), sources.end(), self));
}

const StepImpulse* ImpulseLog::find(int body, std::uint32_t source, std::uint64_t step) const {
    std::vector<Entry>& entries = entries_[static_cast<std::size_t>(body)];
    for (auto entry = entries.rbegin(); entry != entries.rend(); ++entry) {
        if (entry->step != step || entry->source != source) continue;
        if (!entry->impulse) {
            entry->impulse = std::make_unique<StepImpulse>(entry->message->push(entry->offset).impulse);
            world_->spread_modes(body, *entry->impulse);
            entry->message.reset();
        }
        return entry->impulse.get();
    }
    return nullptr;
}

const StepImpulse* ImpulseLog::seen(int body, std::uint32_t source, std::uint64_t step, std::uint64_t known,
                                    StepImpulse& scratch) const {
    if (step <= known) return find(body, source, step);
    const StepImpulse* last = find(body, source, known);
    const StepImpulse* before = last && known > 0 ? find(body, source, known - 1) : nullptr;
    if (!before) return nullptr;
    lasting(*last, *before, scratch);
    return &scratch;
}

void ImpulseLog::prune(std::uint64_t step) {
    if (step % (keep_ / 4) != 0) return;
    for (std::vector<Entry>& entries : entries_)
        std::erase_if(entries, [&](const Entry& entry) { return entry.step + keep_ < step; });
}

}  // namespace sim
