// Keeper: one thread writes the changes of all sessions.

#include <algorithm>
#include <utility>

#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/keeping/keeper.h"

namespace lpdeform {
namespace {

constexpr std::chrono::milliseconds kFirstPause{50}, kLongestPause{2000};
/// The longest pause between retries while the process ends.
constexpr std::chrono::milliseconds kLastPause{200};
constexpr std::chrono::minutes kBetweenWords{1};

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// How serious an error of the store is. The worst one decides the store's state.
int gravity(const absl::Status& status) {
  if (status.ok()) return 0;
  if (is_full(status)) return 1;
  return is_away(status) ? 3 : 2;
}

}  // namespace

void Keeper::run() {
  std::unique_lock lock(mutex_);
  for (bool is_last_try = false;;) {
    // Changes that a full store has not refused need not wait.
    const auto is_time = [this] {
      return is_last() || (!is_writing_failing_ && has_fresh_) || Clock::now() >= retry_at_;
    };
    if (is_pausing()) changed_.wait_until(lock, retry_at_, is_time);
    // While the store fails or is full, the thread wakes for a retry even if nothing is due: only a try can
    // show whether the store works again.
    changed_.wait(lock, [this] { return is_last() || !due_.empty() || is_pausing(); });
    if ((is_stopping_ && due_.empty()) || is_last_try || is_over_) return;
    is_last_try = is_stopping_;
    const bool is_all = is_stopping_ || !is_pausing() || Clock::now() >= retry_at_;
    is_writing_ = true;
    lock.unlock();
    write(take_work(is_all), is_all);
    lock.lock();
    is_writing_ = false;
    changed_.notify_all();
  }
}

/// The present state of everything that is due; without `is_all`, except what a full store has refused.
std::vector<Keeper::Work> Keeper::take_work(bool is_all) {
  std::vector<Work> works;
  {
    const std::scoped_lock lock(mutex_);
    has_fresh_ = false;
    for (const std::string& name : std::exchange(due_, {})) {
      const auto found = entries_.find(name);
      if (found == entries_.end()) continue;
      if (!is_all && found->second.is_refused) {
        due_.insert(name);
        continue;
      }
      const Entry& entry = found->second;
      Work work{name, entry.session, entry.head, entry.is_lost ? 0 : entry.revision, {}};
      work.change.session = name;
      work.change.epoch_before = entry.epoch;
      work.change.is_expiry = entry.is_expired;
      work.change.is_recreated = entry.is_lost;
      if (entry.epoch == 0) {
        work.change.request_id = entry.request_id;
        work.change.blobs = entry.blobs;
      }
      works.push_back(std::move(work));
    }
  }
  for (Work& work : works) fill_in(work);  // outside the lock, because a session may be busy with an update
  return works;
}

void Keeper::fill_in(Work& work) {
  StoredChange& change = work.change;
  change.is_removal = work.session == nullptr;
  if (change.is_removal) return;
  if (change.is_recreated) refill(work);
  const SessionChanges changes = work.session->changes_since(change.epoch_before == 0 ? 0 : work.revision);
  change.revision_before = work.revision;
  change.revision = work.revision = changes.inputs.revision;
  change.epoch = changes.lease.epoch;
  work.input_seq = changes.lease.input_seq;
  change.owner = work.session->owner();
  change.route = work.session->route();
  change.parts = encode_changes(changes);
  change.replaces_all = changes.inputs.is_all;
  if (change.replaces_all) change.parts["head"] = work.head;
}

/// Also fills in the session's blobs.
void Keeper::refill(Work& work) {
  auto head = encode_head_again(*work.session, work.head);
  work.status = head.status();
  if (!head.ok()) return;
  work.head = std::move(head->part);
  work.blobs = std::move(head->blobs);
  for (const auto& [key, bytes] : work.blobs) work.change.blobs.push_back(key);
  if (const auto read = decode_head({{"head", work.head}}); read.ok())
    work.change.request_id = read->request.request_id();
}

/// Writes all changes at once. If that fails, writes them one by one, so that one bad change does not block
/// the others. If the store does not answer, it does not try again: each change would wait for the timeout.
void Keeper::write(std::vector<Work> works, bool is_all) {
  Calls calls;
  auto outcomes = commit(works);
  absl::Status health = outcomes.status();
  const bool is_alone = !outcomes.ok() && works.size() > 1 && !is_away(health);
  if (is_alone) health = absl::OkStatus();
  for (std::size_t k = 0; k < works.size(); ++k) {
    const std::span<const Work> one(&works[k], 1);
    const auto again = is_alone ? commit(one) : outcomes;
    if (is_alone && gravity(again.status()) > gravity(health)) health = again.status();
    const std::scoped_lock lock(mutex_);
    if (again.ok()) {
      note_kept(works[k], (*again)[is_alone ? 0 : k], calls);
    } else {
      note_failed(works[k], again.status(), calls);
    }
  }
  {
    const std::scoped_lock lock(mutex_);
    if (!is_over_) note_written(health, is_all);
  }
  make(calls);
}

/// The number of bytes that these changes send to the store.
std::size_t Keeper::bytes_of(std::span<const Work> works) {
  std::size_t bytes = 0;
  for (const Work& work : works) {
    for (const auto& [key, blob] : work.blobs) bytes += blob.size();
    for (const auto& [key, part] : work.change.parts) bytes += part ? part->size() : 0;
  }
  return bytes;
}

/// Fails once flush() has told what is not stored.
absl::Status Keeper::check_end() const {
  const std::scoped_lock lock(mutex_);
  return is_over_ ? store_failing(kEnds) : absl::OkStatus();
}

absl::StatusOr<std::vector<ChangeOutcome>> Keeper::commit(std::span<const Work> works) {
  std::vector<StoredChange> changes;
  const Clock::time_point begin = Clock::now();
  absl::Status status;
  const StoreCalls::UnderWay call(calls_, begin, bytes_of(works));
  for (const Work& work : works) {
    changes.push_back(work.change);
    status.Update(work.status);
    for (const auto& [key, bytes] : work.blobs) {
      status.Update(check_end());
      if (status.ok()) status.Update(store_->keep_blob(work.name, key, bytes));
    }
  }
  status.Update(check_end());
  auto outcomes = status.ok() ? store_->commit(changes) : status;
  services_.metrics->observe(Span::kStoreWrite, seconds_since(begin));
  if (!outcomes.ok()) services_.metrics->add(Count::kStoreErrors);
  return outcomes;
}

/// Called with the lock held. Callbacks to make afterwards are added to `calls`.
void Keeper::note_kept(const Work& work, ChangeOutcome outcome, Calls& calls) {
  const auto found = entries_.find(work.name);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  if (entry.session != nullptr && work.session != nullptr && entry.session != work.session)
    return;  // it left and came back meanwhile: this write was of an earlier epoch
  if (work.change.is_removal || outcome == ChangeOutcome::kFenced) {
    for (OnDone& on_removed : entry.on_removed)
      calls.add([on_removed = std::move(on_removed)] { on_removed(absl::OkStatus()); });
    answer_all(entry, calls);
    if (entry.session != nullptr)
      services_.log->info("session_lost", {{"session", abbreviated(work.name)}, {"epoch", entry.epoch}});
    if (entry.session != nullptr && on_lost) calls.add([this, lost = entry.session] { on_lost(*lost); });
    due_.erase(work.name);
    entries_.erase(found);
    return;
  }
  if (outcome == ChangeOutcome::kBehind) return write_all(entry, work.name);
  if (outcome == ChangeOutcome::kLost) return rewrite(entry, work.name);
  if (work.change.is_recreated) entry.head = work.head;
  if (work.change.is_recreated) entry.is_lost = false;
  entry.is_refused = false;
  entry.revision = work.revision;
  entry.epoch = work.change.epoch;
  entry.input_seq = work.input_seq;
  if (entry.on_added)
    calls.add([on_added = std::exchange(entry.on_added, nullptr)] { on_added(absl::OkStatus()); });
  answer_kept(entry, calls);
  if (entry.is_leaving && !due_.contains(work.name)) {
    entries_.erase(found);
    calls.to_release.push_back({work.name, work.change.epoch});
  }
}

/// Called with the lock held. The store lost changes that it had confirmed, and this process still has them.
void Keeper::write_all(Entry& entry, const std::string& name) {
  entry.revision = entry.input_seq = 0;
  due(name);
  services_.log->warning("store_went_back",
                         {{"session", abbreviated(name)}, {"text", "The whole session is written again."}});
}

/// Called with the lock held. The store lost the whole session.
void Keeper::rewrite(Entry& entry, const std::string& name) {
  entry.is_lost = true;
  write_all(entry, name);
}

/// Called with the lock held. The changes stay due. A new session is given up, and removed in case the store
/// has it all the same.
void Keeper::note_failed(const Work& work, const absl::Status& why, Calls& calls) {
  const auto found = entries_.find(work.name);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  entry.is_refused = is_full(why);
  if (entry.on_added) {
    entry.session.reset();
    entry.is_refused = false;
  }
  answer_failed(entry, why, calls);
  due(work.name);
}

/// Called with the lock held. Answers everyone who waits for something of this entry.
void Keeper::answer_failed(Entry& entry, const absl::Status& why, Calls& calls) {
  if (entry.on_added) calls.add([on_added = std::exchange(entry.on_added, nullptr), why] { on_added(why); });
  for (OnDone& on_removed : std::exchange(entry.on_removed, {}))
    calls.add([on_removed = std::move(on_removed), why] { on_removed(why); });
  services_.metrics->add(Count::kUpdatesNotKept, static_cast<double>(entry.waiting.size()));
  for (const Waiting& one : entry.waiting) note_waited(one);
  answer_all(entry, calls);
}

/// Answers the updates that are stored.
void Keeper::answer_kept(Entry& entry, Calls& calls) {
  std::erase_if(entry.waiting, [&](Waiting& one) {
    const bool is_kept = one.revision <= entry.revision && one.epoch <= entry.epoch;
    if (!is_kept) return false;
    note_waited(one);
    calls.add([on_kept = std::move(one.on_kept)] { on_kept(true); });
    return true;
  });
}

void Keeper::answer_all(Entry& entry, Calls& calls) {
  for (Waiting& one : std::exchange(entry.waiting, {}))
    calls.add([on_kept = std::move(one.on_kept)] { on_kept(false); });
}

void Keeper::make(const Calls& calls) {
  for (const auto& call : calls.all) call();
  // If this is not done, the sessions are free when the lease ends.
  if (!calls.to_release.empty()) store_->release(calls.to_release).IgnoreError();
}

void Keeper::note_waited(const Waiting& one) {
  services_.metrics->observe(Span::kInputToKept, seconds_since(one.since));
}

/// Called with the lock held. Without `is_all`, changes that the store had refused before were not tried.
void Keeper::note_written(const absl::Status& status, bool is_all) {
  const bool was_pausing = is_pausing();
  is_writing_failing_ = gravity(status) > 1;
  is_full_ = is_full(status) || (is_full_ && !is_all);
  if (!status.ok()) {
    const Clock::duration longest = is_ending_ ? kLastPause : kLongestPause;
    pause_ = was_pausing ? std::min<Clock::duration>(2 * pause_, longest) : kFirstPause;
    retry_at_ = Clock::now() + pause_;
  }
  note_full(status);
  note_health(status);
}

/// Called with the lock held. show_room() finds out when there is room again.
void Keeper::note_full(const absl::Status& status) {
  if (!is_full(status) || std::exchange(was_full_, true)) return;
  services_.metrics->set(Level::kStoreFull, 1);
  services_.log->warning("store_full", {{"text", text_for_operators(status)}});
}

/// Notes whether the store answers. Anything but STORE_FAILING is an answer.
void Keeper::note_read(const absl::Status& status, Clock::time_point begin) {
  const bool is_failing = fault_of(status).reason == Reason::kStoreFailing;
  if (is_failing) services_.metrics->add(Count::kStoreErrors);
  const std::scoped_lock lock(mutex_);
  if (!std::exchange(is_reading_failing_, is_failing) && is_failing) try_again_later();
  is_hanging_ = is_failing && Clock::now() - begin > kPatience;
  note_health(status);
}

/// Called with the lock held, after one of the flags has changed.
void Keeper::note_health(const absl::Status& status) {
  const bool is_failing = is_writing_failing_ || is_reading_failing_ || is_stuck_;
  if (std::exchange(was_failing_, is_failing) == is_failing) return;
  services_.metrics->set(Level::kStoreFailing, is_failing ? 1 : 0);
  if (is_failing) {
    services_.log->warning("store_failing", {{"text", text_for_operators(status)}});
  } else {
    services_.log->info("store_works", {{"text", "The store works again and has all changes."}});
  }
}

/// Updates were answered before they were stored, because the store took too long. One line per minute is
/// enough.
void Keeper::note_slow(std::size_t updates) {
  services_.metrics->add(Count::kUpdatesNotKept, static_cast<double>(updates));
  const Clock::time_point now = Clock::now();
  const std::scoped_lock lock(mutex_);
  if (updates == 0 || now < next_word_) return;
  next_word_ = now + kBetweenWords;
  services_.log->warning("store_slow",
                         {{"text", "The store is slow: updates are answered before they are stored."}});
}

}  // namespace lpdeform
