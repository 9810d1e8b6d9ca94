#include "server/session/mailbox.h"

#include <algorithm>
#include <limits>
#include <set>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/problem/handle_name.h"
#include "server/session/mailbox_candidate.h"

namespace lpdeform {
namespace {

/// Leaves numbers for a new writer to continue with, and fits signed 64-bit integers.
constexpr std::uint64_t kHighestInputSeq = std::numeric_limits<std::int64_t>::max();

absl::Status too_high(std::uint64_t input_seq) {
  return make_fault({Reason::kInputSeqTooHigh, "input_seq", "input_seq < 2^63"},
                    absl::StrCat("The update's input_seq is ", input_seq, "; it must be below 2^63."));
}

absl::Status passed(std::uint64_t newest) {
  return make_fault(
      {Reason::kInputSeqPassed, "input_seq", absl::StrCat("input_seq > ", newest)},
      absl::StrCat("An undo needs an input_seq above ", newest, ". Read the session's state and try again."));
}

absl::Status nothing_to(bool redo) {
  return redo ? make_fault({Reason::kNothingToRedo, "", ""}, "There is no step to redo.")
              : make_fault({Reason::kNothingToUndo, "", ""}, "There is no step to undo.");
}

/// The effects of changes that are all made.
HandleEffects effects_of(const std::vector<HandleChange>& changes) {
  HandleEffects effects;
  for (const HandleChange& change : changes) {
    const bool is_motion = std::holds_alternative<HandleMotion>(change.change);
    (is_motion ? effects.moved : effects.regrouped).push_back(change.name);
  }
  return effects;
}

}  // namespace

Mailbox::Mailbox(std::shared_ptr<const RestShape> shape, std::shared_ptr<const Weld> weld, InputLimits limits,
                 std::shared_ptr<Timers> timers)
    : shape_(std::move(shape)),
      weld_(std::move(weld)),
      limits_(limits),
      timers_(std::move(timers)),
      history_(limits.undo_steps) {
  inputs_.handles = inputs_.given_handles = std::make_shared<const HandleSet>();
  inputs_.material = inputs_.given_material = std::make_shared<const Material>();
}

Inputs Mailbox::newest() const {
  const std::scoped_lock lock(mutex_);
  return inputs_;
}

std::uint64_t Mailbox::version() const {
  const std::scoped_lock lock(mutex_);
  return inputs_.version;
}

absl::StatusOr<UpdateResult> Mailbox::take(const Update& update) {
  if (update.input_seq > kHighestInputSeq) return too_high(update.input_seq);
  if (update.input_seq == 0) {
    return make_fault({Reason::kInputSeqZero, "input_seq", "input_seq >= 1"},
                      "The update's input_seq is 0; numbers rise from 1.");
  }
  const std::scoped_lock merging(merging_);
  return merge(update, Origin::kWriter);
}

absl::Status Mailbox::begin_with(const Update& update) {
  const std::scoped_lock merging(merging_);
  return merge(update, Origin::kBeginning).status();
}

absl::Status Mailbox::begin_again(const Update& state, InputAges ages, InputHistory history) {
  if (state.input_seq > kHighestInputSeq) return too_high(state.input_seq);
  if (ages.handles.size() > 2 * limits_.handles)
    return too_many_handles(ages.handles.size(), 2 * limits_.handles);
  if (absl::Status status = begin_with(state); !status.ok()) return status;
  const std::scoped_lock merging(merging_);
  ages_ = std::move(ages);
  history_.begin_again(history.first, history.undo_steps, std::move(history.steps));
  if (history.is_undo || history.is_redo) remember_undo(history.is_redo);
  return absl::OkStatus();
}

/// Rebuilds the answer to the newest input if that was an undo or a redo. Its caller may not have received
/// the answer before the session was restored. The changes of that input are the present values of all
/// handles that the step in the other direction changes.
void Mailbox::remember_undo(bool redo) {
  const std::vector<HandleChange>* const back = history_.next(!redo);
  if (back == nullptr) return;  // the step was too large to be kept
  const Inputs now = newest();
  const UpdateResult result{now.input_seq, 0, revisions_.newest};
  last_undo_ = {now.input_seq,
                redo,
                {result, changes_back(*now.given_handles, effects_of(*back)), history_.undo_steps(),
                 history_.redo_steps()}};
}

absl::StatusOr<UndoResult> Mailbox::undo(std::uint64_t input_seq, bool redo) {
  const std::scoped_lock merging(merging_);
  if (last_undo_ && last_undo_->input_seq == input_seq && last_undo_->redo == redo) return last_undo_->result;
  if (input_seq > kHighestInputSeq) return too_high(input_seq);
  const Inputs before = newest();
  if (input_seq <= before.input_seq) return passed(before.input_seq);
  const std::vector<HandleChange>* const changes = history_.next(redo);
  if (changes == nullptr) return nothing_to(redo);
  Update update{input_seq, *changes, {}, false};
  std::vector<HandleChange> inverse = changes_back(*before.given_handles, effects_of(*changes));
  const auto merged = merge(update, Origin::kHistory);
  if (!merged.ok()) return merged.status();
  history_.moved(redo, std::move(inverse), revisions_.newest);
  last_undo_ = {
      input_seq, redo, {*merged, std::move(update.handles), history_.undo_steps(), history_.redo_steps()}};
  return last_undo_->result;
}

Mailbox::HistorySize Mailbox::history_size() const {
  const std::scoped_lock merging(merging_);
  return {history_.undo_steps(), history_.redo_steps(), history_.bytes()};
}

std::uint64_t Mailbox::revision() const {
  const std::scoped_lock merging(merging_);
  return revisions_.newest;
}

InputChanges Mailbox::changes_since(std::uint64_t revision) const {
  const std::scoped_lock merging(merging_);
  InputChanges changes;
  changes.revision = revisions_.newest;
  changes.inputs = newest();
  changes.ages = ages_;
  changes.is_all = revision == 0 || revisions_.all > revision;
  for (const auto& [name, at] : revisions_.handles) {
    if (!changes.inputs.given_handles->handles().contains(name)) {
      if (at.removed > revision) changes.removed.push_back(name);
      continue;
    }
    if (changes.is_all || at.set > revision) changes.regrouped.push_back(name);
    if (changes.is_all || std::max(at.set, at.moved) > revision) changes.moved.push_back(name);
  }
  changes.has_p = changes.is_all || revisions_.p > revision;
  changes.has_stiffness = changes.is_all || revisions_.stiffness > revision;
  changes.has_region = changes.is_all || revisions_.region > revision;
  changes.history = history_.extent();
  changes.steps = history_.changes_since(changes.is_all ? 0 : revision);
  const bool is_newest = last_undo_ && last_undo_->input_seq == changes.inputs.input_seq;
  changes.is_undo = is_newest && !last_undo_->redo;
  changes.is_redo = is_newest && last_undo_->redo;
  return changes;
}

/// Called with the lock held.
absl::StatusOr<UpdateResult> Mailbox::merge(const Update& update, Origin origin) {
  const Inputs before = newest();
  Candidate next;
  next.is_beginning = origin == Origin::kBeginning;
  next.material = *before.given_material;
  next.solver = before.solver;
  if (!update.handles.empty() || update.settings.region) {
    next.handles = std::make_shared<HandleSet>(*before.given_handles);
  }
  if (absl::Status status = change_handles(update, next); !status.ok()) return status;
  change_settings(update, next);
  if (absl::Status status = check(next, before); !status.ok()) return status;
  if (absl::Status status = weld(next); !status.ok()) return status;
  if (absl::Status status = check_welded(next); !status.ok()) return status;

  const bool is_newer = update.input_seq > before.input_seq;
  const bool changes_something = is_newer || next.changes_something();
  put_in_force(update, next);
  note_ages(next, update.input_seq);
  if (changes_something) note_revisions(next);
  if (origin == Origin::kWriter) note_step(update, next, before);
  return UpdateResult{update.input_seq, next.stale_parts, revisions_.newest};
}

void Mailbox::put_in_force(const Update& update, Candidate& next) {
  const std::scoped_lock lock(mutex_);
  const bool is_newer = update.input_seq > inputs_.input_seq;
  if (is_newer || next.has_handles() || next.has_material() || next.has_solver) ++inputs_.version;
  if (is_newer) {
    inputs_.input_seq = update.input_seq;
    ++inputs_.taken;
  }
  if (next.has_handles()) {
    inputs_.given_handles = std::move(next.handles);
    inputs_.handles = next.solver_handles ? next.solver_handles : inputs_.given_handles;
  }
  if (next.has_material()) {
    inputs_.given_material = std::make_shared<const Material>(std::move(next.material));
    inputs_.material = next.solver_material ? next.solver_material : inputs_.given_material;
  }
  inputs_.solver = next.solver;
}

/// Whether this part of the update is newer than the value of this age. Counts the part as stale if it is
/// older.
bool Mailbox::replaces(std::uint64_t age, const Update& update, Candidate& next) const {
  if (next.is_beginning) return true;
  if (update.input_seq < age) ++next.stale_parts;
  return update.input_seq > age;
}

bool Mailbox::replaces_handle(const std::string& name, const Update& update, Candidate& next) const {
  const auto known = ages_.handles.find(name);
  if (known != ages_.handles.end()) return replaces(known->second, update, next);
  const bool is_forgotten = update.input_seq <= ages_.forgotten && !next.is_beginning;
  if (is_forgotten) ++next.stale_parts;
  return !is_forgotten;
}

absl::Status Mailbox::change_handles(const Update& update, Candidate& next) const {
  std::set<std::string_view> names;
  for (const HandleChange& change : update.handles) {
    if (!names.insert(change.name).second) {
      return make_fault({Reason::kHandleChangedTwice, handle_element(change.name), "one change a handle"},
                        absl::StrCat("The update changes ", handle_element(change.name), " twice."));
    }
    if (absl::Status named = check_handle_name(change.name); !named.ok()) return named;
    if (!replaces_handle(change.name, update, next)) continue;
    next.named.push_back(change.name);
    absl::Status status;
    if (const auto* const handle = std::get_if<Handle>(&change.change)) {
      status = next.handles->set(change.name, *handle);
      next.is_regrouped = true;
      next.regrouped.push_back(change.name);
      next.moved.push_back(change.name);
    } else if (const auto* const motion = std::get_if<HandleMotion>(&change.change)) {
      status = next.handles->set_motion(change.name, *motion);
      next.moved.push_back(change.name);
    } else {
      next.is_regrouped = next.handles->remove(change.name) || next.is_regrouped;
      next.removed.push_back(change.name);
    }
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

void Mailbox::change_settings(const Update& update, Candidate& next) const {
  const SettingsChange& settings = update.settings;
  next.has_p = settings.p && replaces(ages_.p, update, next);
  next.has_stiffness = settings.stiffness && replaces(ages_.stiffness, update, next);
  next.has_length_unit = settings.length_unit && replaces(ages_.length_unit, update, next);
  next.has_solver = settings.solver && replaces(ages_.solver, update, next);
  if (next.has_p) next.material.p = *settings.p;
  if (next.has_stiffness) next.material.stiffness = *settings.stiffness;
  if (next.has_length_unit) next.material.length_unit = *settings.length_unit;
  if (next.has_solver) next.solver = *settings.solver;
  next.has_region = settings.region && replaces(ages_.region, update, next);
  if (!next.has_region) return;
  next.is_regrouped = true;
  if (settings.region->empty())
    next.handles->clear_region();
  else
    next.handles->set_region(*settings.region);
}

void Mailbox::note_ages(const Candidate& next, std::uint64_t seq) {
  for (const std::string& name : next.named) ages_.handles[name] = seq;
  if (next.has_p) ages_.p = seq;
  if (next.has_stiffness) ages_.stiffness = seq;
  if (next.has_length_unit) ages_.length_unit = seq;
  if (next.has_solver) ages_.solver = seq;
  if (next.has_region) ages_.region = seq;
  // Ages are kept for the handles in force and for as many that were removed.
  if (ages_.handles.size() > 2 * limits_.handles) forget_oldest();
}

/// Called after the values in force were changed.
void Mailbox::note_revisions(const Candidate& next) {
  const std::uint64_t now = ++revisions_.newest;
  for (const std::string& name : next.regrouped) revisions_.handles[name].set = now;
  for (const std::string& name : next.moved) revisions_.handles[name].moved = now;
  for (const std::string& name : next.removed) revisions_.handles[name].removed = now;
  if (next.has_p) revisions_.p = now;
  if (next.has_stiffness) revisions_.stiffness = now;
  if (next.has_region) revisions_.region = now;
}

void Mailbox::note_step(const Update& update, const Candidate& next, const Inputs& before) {
  const Timers::TimePoint now = timers_ ? timers_->now() : Timers::TimePoint();
  history_.note(*before.given_handles, *newest().given_handles,
                {next.regrouped, next.moved, next.removed, update.begins_step}, now, revisions_.newest);
  if (history_.forget_dropped()) revisions_.all = revisions_.newest;
}

/// Forgets the ages of the older half of the removed handles.
void Mailbox::forget_oldest() {
  const Inputs inputs = newest();
  const auto is_gone = [&](const std::string& name) { return !inputs.handles->handles().contains(name); };
  std::vector<std::uint64_t> gone;
  for (const auto& [name, age] : ages_.handles) {
    if (is_gone(name)) gone.push_back(age);
  }
  if (gone.empty()) return;
  const auto middle = gone.begin() + static_cast<std::ptrdiff_t>(gone.size() / 2);
  std::nth_element(gone.begin(), middle, gone.end());
  ages_.forgotten = std::max(ages_.forgotten, *middle);
  std::erase_if(ages_.handles,
                [&](const auto& entry) { return entry.second <= *middle && is_gone(entry.first); });
  std::erase_if(revisions_.handles, [&](const auto& entry) { return !ages_.handles.contains(entry.first); });
  revisions_.all = revisions_.newest + 1;  // the caller is about to note this very revision
}

}  // namespace lpdeform
