#include "server/session/history.h"

#include <algorithm>
#include <set>
#include <utility>

namespace lpdeform {
namespace {

/// Limit of dropped steps that are remembered for the store.
constexpr std::size_t kMostDropped = 4096;

std::size_t bytes_of(const HandleMotion& motion) {
  const auto* const targets = std::get_if<TargetPositions>(&motion);
  return sizeof(HandleMotion) +
         (targets == nullptr ? 0 : static_cast<std::size_t>(targets->positions.size()) * sizeof(double));
}

std::size_t bytes_of(const HandleChange& change) {
  std::size_t bytes = sizeof(HandleChange) + change.name.size();
  if (const auto* const motion = std::get_if<HandleMotion>(&change.change)) bytes += bytes_of(*motion);
  if (const auto* const handle = std::get_if<Handle>(&change.change)) {
    bytes += bytes_of(handle->motion) + handle->vertices.size() * sizeof(std::int32_t) +
             handle->points.size() * sizeof(SurfacePoint);
  }
  return bytes;
}

/// Whether the update changed anything: a resent update may set what is already set.
bool is_change(const HandleSet& before, const HandleSet& after, const HandleEffects& effects) {
  const auto differs = [&](const std::string& name) {
    const auto was = before.handles().find(name), is = after.handles().find(name);
    if (was == before.handles().end() || is == after.handles().end()) return true;
    return !(was->second == is->second);
  };
  return std::ranges::any_of(effects.moved, differs) ||
         std::ranges::any_of(effects.removed,
                             [&](const auto& name) { return before.handles().contains(name); });
}

}  // namespace

std::vector<HandleChange> changes_back(const HandleSet& before, const HandleEffects& effects) {
  std::vector<HandleChange> changes;
  std::set<std::string> done;
  const auto put_back = [&](const std::string& name) {
    const auto handle = before.handles().find(name);
    const bool was_there = handle != before.handles().end();
    if (done.insert(name).second)
      changes.push_back({name, was_there ? decltype(HandleChange::change)(handle->second) : Removal{}});
  };
  for (const std::string& name : effects.regrouped) put_back(name);
  for (const std::string& name : effects.removed) {
    if (before.handles().contains(name)) put_back(name);
  }
  for (const std::string& name : effects.moved) {
    const auto handle = before.handles().find(name);
    if (handle != before.handles().end() && done.insert(name).second)
      changes.push_back({name, handle->second.motion});
  }
  return changes;
}

void HandleHistory::note(const HandleSet& before, const HandleSet& after, const HandleEffects& effects,
                         Timers::TimePoint now, std::uint64_t revision) {
  if (most_steps_ == 0) return;
  if (effects.regrouped.empty() && effects.moved.empty() && effects.removed.empty()) return;
  const bool only_moves = effects.regrouped.empty() && effects.removed.empty();
  std::vector<std::string> names = only_moves ? effects.moved : std::vector<std::string>();
  std::ranges::sort(names);
  const bool goes_on =
      !effects.begins_step && only_moves && names == gesture_ && now - last_ <= kPause && redo_steps() == 0;
  const bool is_step = !goes_on && is_change(before, after, effects);
  if (goes_on || is_step) last_ = now;
  if (!goes_on && effects.begins_step) gesture_.clear();
  if (!is_step) return;
  while (redo_steps() > 0) drop_last(revision);
  put(steps_.size(), changes_back(before, effects), revision);
  ++undo_steps_;
  gesture_ = std::move(names);
  keep_limits(revision);
}

const std::vector<HandleChange>* HandleHistory::next(bool redo) const {
  if (redo) return redo_steps() == 0 ? nullptr : &steps_[undo_steps_].changes;
  return undo_steps_ == 0 ? nullptr : &steps_[undo_steps_ - 1].changes;
}

void HandleHistory::moved(bool redo, std::vector<HandleChange> inverse, std::uint64_t revision) {
  put(redo ? undo_steps_ : undo_steps_ - 1, std::move(inverse), revision);
  redo ? ++undo_steps_ : --undo_steps_;
  gesture_.clear();
  keep_limits(revision);
}

/// Puts a step in place of an existing one, or after the last one.
void HandleHistory::put(std::size_t place, std::vector<HandleChange> changes, std::uint64_t revision) {
  Step step{std::move(changes), 0, revision};
  for (const HandleChange& change : step.changes) step.bytes += bytes_of(change);
  bytes_ += step.bytes;
  if (place < steps_.size()) {
    bytes_ -= steps_[place].bytes;
    steps_[place] = std::move(step);
  } else {
    dropped_.erase(first_ + place);
    steps_.push_back(std::move(step));
  }
}

void HandleHistory::drop_last(std::uint64_t revision) {
  bytes_ -= steps_.back().bytes;
  steps_.pop_back();
  dropped_[first_ + steps_.size()] = revision;
  undo_steps_ = std::min(undo_steps_, steps_.size());
}

void HandleHistory::drop_first(std::uint64_t revision) {
  bytes_ -= steps_.front().bytes;
  steps_.pop_front();
  dropped_[first_++] = revision;
  if (undo_steps_ > 0) --undo_steps_;
}

/// A step that is too large cannot be kept, nor can the steps beyond it: they are dropped together.
void HandleHistory::keep_limits(std::uint64_t revision) {
  const auto is_too_large = [](const Step& step) { return step.bytes > kMostBytesAStep; };
  while (std::any_of(steps_.begin(), steps_.begin() + static_cast<std::ptrdiff_t>(undo_steps_), is_too_large))
    drop_first(revision);
  while (std::any_of(steps_.begin() + static_cast<std::ptrdiff_t>(undo_steps_), steps_.end(), is_too_large))
    drop_last(revision);
  while (undo_steps_ > 0 && (steps_.size() > most_steps_ || bytes_ > kMostBytes)) drop_first(revision);
  while (steps_.size() > most_steps_ || bytes_ > kMostBytes) drop_last(revision);
}

HandleHistory::Changes HandleHistory::changes_since(std::uint64_t revision) const {
  Changes changes;
  for (const auto& [number, since] : dropped_) {
    if (since > revision) changes.dropped.push_back(number);
  }
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    if (revision == 0 || steps_[k].revision > revision) changes.steps.emplace(first_ + k, steps_[k].changes);
  }
  return changes;
}

bool HandleHistory::forget_dropped() {
  if (dropped_.size() <= kMostDropped) return false;
  dropped_.clear();
  return true;
}

void HandleHistory::begin_again(std::uint64_t first, std::size_t undo_steps,
                                std::vector<std::vector<HandleChange>> steps) {
  first_ = first;
  for (auto& changes : steps) put(steps_.size(), std::move(changes), 0);
  undo_steps_ = std::min(undo_steps, steps_.size());
  keep_limits(1);
}

}  // namespace lpdeform
