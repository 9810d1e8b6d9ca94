#include "client/cpp/ledger.h"

#include <algorithm>
#include <utility>

namespace lpdeform::client {
namespace {

const std::string kResizeHandle = "resize";

template <typename T>
void replace_where_given(std::optional<T>& older, std::optional<T>& newer) {
  if (newer) older.swap(newer);
}

void merge_change(Update::Change& older, Update::Change&& newer) {
  auto* const added = std::get_if<Handle>(&older);
  auto* const motion = std::get_if<Motion>(&newer);
  if (added && motion) {
    added->motion = std::move(*motion);
  } else {
    older = std::move(newer);
  }
}

/// Bounds the memory for removed handles. Motions stay, since they belong to handles that the session was created with.
void forget_removals(Update& update) {
  const auto is_removal = [](const auto& entry) {
    return std::holds_alternative<Update::Removal>(entry.second);
  };
  if (update.handles.size() <= Ledger::kMostRemovals) return;
  const auto count = static_cast<std::size_t>(std::ranges::count_if(update.handles, is_removal));
  if (count > Ledger::kMostRemovals) std::erase_if(update.handles, is_removal);
}

/// Reduces `state` to the handles that exist after its motions and removals.
void settle_changes(Update& state) {
  std::erase_if(state.handles,
                [](const auto& entry) { return !std::holds_alternative<Handle>(entry.second); });
  state.begins_step = false;
}

/// A resizing replaces the handle and the fields that it sets, and a later change of its handle replaces it.
void merge_resize(Update& older, Update& newer) {
  if (newer.handles.contains(kResizeHandle)) older.resize.reset();
  if (!newer.resize) return;
  older.handles.erase(kResizeHandle);
  older.settings.p.reset();
  older.settings.stiffness.reset();
  older.resize.swap(newer.resize);
}

bool only_moves(const NumberedUpdate& numbered) {
  const Update& update = numbered.update;
  const Settings& settings = update.settings;
  const bool sets =
      settings.p || settings.stiffness || settings.length_unit || settings.solver || settings.region;
  return !sets && !update.resize && !update.begins_step &&
         std::ranges::all_of(update.handles,
                             [](const auto& entry) { return std::holds_alternative<Motion>(entry.second); });
}

}  // namespace

void merge(Update& older, Update newer) {
  merge_resize(older, newer);
  for (auto& [name, change] : newer.handles) {
    const auto [place, is_new] = older.handles.try_emplace(name, std::move(change));
    if (!is_new) merge_change(place->second, std::move(change));
  }
  replace_where_given(older.settings.p, newer.settings.p);
  replace_where_given(older.settings.stiffness, newer.settings.stiffness);
  replace_where_given(older.settings.length_unit, newer.settings.length_unit);
  replace_where_given(older.settings.solver, newer.settings.solver);
  replace_where_given(older.settings.region, newer.settings.region);
  older.begins_step = older.begins_step || newer.begins_step;
}

void join(NumberedUpdate& one, NumberedUpdate other) {
  if (other.seq < one.seq) std::swap(one, other);
  merge(one.update, std::move(other.update));
  one.seq = other.seq;
}

std::uint64_t Ledger::add(Update update) {
  const std::uint64_t seq = next_seq_++;
  if (!waiting_) waiting_.emplace();
  merge(waiting_->update, std::move(update));
  waiting_->seq = seq;
  return seq;
}

bool Ledger::can_send() const {
  if (!has_waiting() || in_flight_.size() >= kWindow) return false;
  if (order_ == Order::kWritten || in_flight_.empty()) return true;
  return in_flight_.size() < kUnorderedWindow && only_moves(restore_ ? *restore_ : *waiting_) &&
         std::ranges::all_of(in_flight_, only_moves);
}

NumberedUpdate Ledger::send_next() {
  auto& source = restore_ ? restore_ : waiting_;
  if (restore_) restores_.insert_or_assign(restore_->seq, *restore_);
  in_flight_.push_back(std::move(*source));
  source.reset();
  return in_flight_.back();
}

void Ledger::accept(std::uint64_t seq, bool is_kept) {
  const auto sent = std::ranges::find(in_flight_, seq, &NumberedUpdate::seq);
  if (sent == in_flight_.end()) {
    if (is_kept && seq >= unkept_.seq) unkept_ = {};  // shown before it was answered
    return;
  }
  NumberedUpdate update = std::move(*sent);
  in_flight_.erase(sent);
  restores_.erase(seq);
  merge_accepted(std::move(update), is_kept);
}

void Ledger::show(std::uint64_t epoch, std::uint64_t seq) {
  const bool is_first = epoch == epoch_ && !in_flight_.empty() && in_flight_.front().seq == seq;
  if (is_first && !restores_.contains(seq)) accept(seq);
}

void Ledger::accept_change(NumberedUpdate change, bool is_kept) {
  merge_accepted(std::move(change), is_kept);
}

void Ledger::merge_accepted(NumberedUpdate update, bool is_kept) {
  if (!is_kept) {
    join(unkept_, update);
  } else if (update.seq >= unkept_.seq) {
    unkept_ = {};
  }
  forget_removals(unkept_.update);
  if (restore_) join(*restore_, update);
  for (auto& [seq, again] : restores_) join(again, update);
  join(accepted_, std::move(update));
  if (begins_bare_) {
    settle_changes(accepted_.update);
  } else {
    forget_removals(accepted_.update);
  }
}

void Ledger::resumed_at(std::uint64_t seq) {
  if (seq < unkept_.seq && !restore_) restore_ = NumberedUpdate{accepted_.seq, unkept_.update};
}

void Ledger::refuse(std::uint64_t seq) {
  std::erase_if(in_flight_, [seq](const NumberedUpdate& sent) { return sent.seq == seq; });
  restores_.erase(seq);
}

void Ledger::reopened(std::uint64_t epoch, std::uint64_t seq) {
  const bool is_another = epoch > epoch_;
  epoch_ = std::max(epoch, epoch_);
  resumed_at(is_another ? 0 : seq);
}

void Ledger::connection_lost() {
  std::optional<NumberedUpdate> again;
  for (NumberedUpdate& sent : in_flight_) {
    const auto again_restored = restores_.find(sent.seq);
    if (again_restored != restores_.end()) {  // an unanswered restore stays on its own
      NumberedUpdate restored = std::move(again_restored->second);
      if (restore_) join(restored, *std::move(restore_));
      restore_ = std::move(restored);
      continue;
    }
    if (!again) again.emplace();
    merge(again->update, std::move(sent.update));
    again->seq = std::max(again->seq, sent.seq);
  }
  in_flight_.clear();
  restores_.clear();
  if (!again) return;
  if (waiting_) {
    merge(again->update, std::move(waiting_->update));
    again->seq = waiting_->seq;
  }
  waiting_ = std::move(again);
}

void Ledger::session_lost() {
  connection_lost();
  if (accepted_.seq > 0) restore_ = accepted_;
}

void Ledger::drop_unaccepted() {
  newest_dropped_ = newest();
  restore_.reset();
  unkept_ = {};
  in_flight_.clear();
  restores_.clear();
  waiting_.reset();
}

void Ledger::count_from(std::uint64_t seq) {
  if (next_seq_ > seq) return;
  next_seq_ = seq + 1;
  if (waiting_) waiting_->seq = next_seq_++;
}

std::uint64_t Ledger::newest() const {
  if (waiting_) return waiting_->seq;
  std::uint64_t newest = accepted_.seq;
  for (const NumberedUpdate& sent : in_flight_) newest = std::max(newest, sent.seq);
  return newest;
}

}  // namespace lpdeform::client
