#include "server/keeper.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "server/refusals.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestQueue = 4096;
constexpr std::chrono::milliseconds kFirstPause{50}, kLongestPause{2000};
/// Between looks whether another process has let go of a session.
constexpr std::chrono::milliseconds kBetweenLooks{50};
/// How often those are looked for that nobody uses, in their time without use.
constexpr int kSweepsPerIdle = 8;

double seconds_since(std::chrono::steady_clock::time_point begin) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

/// By another way they come to where it is: here they would wait in vain.
bool leads_elsewhere(const Fault& fault, const std::string& route) {
  return !route.empty() && !fault.limit.empty() && fault.limit != route_header(route);
}

}  // namespace

Keeper::Keeper(std::shared_ptr<Store> store, Services services)
    : store_(std::move(store)), services_(std::move(services)), reader_(1, kLongestQueue) {
  writer_ = std::thread([this] { run(); });
}

std::shared_ptr<Keeper> Keeper::create(std::shared_ptr<Store> store, Services services) {
  std::shared_ptr<Keeper> keeper(new Keeper(std::move(store), std::move(services)));
  keeper->watch_unused();
  return keeper;
}

Keeper::~Keeper() {
  {
    const std::scoped_lock lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_all();
  writer_.join();
}

void Keeper::due(const std::string& name) {
  due_.insert(name);
  changed_.notify_all();
}

void Keeper::add(std::shared_ptr<Session> session, StoredHead head, const std::string& request_id,
                 OnDone on_done) {
  {
    std::unique_lock lock(mutex_);
    if (is_failing_) {
      lock.unlock();
      return on_done(store_failing("it has not taken the last change yet"));
    }
  }
  Entry entry;
  entry.session = std::move(session);
  entry.head = std::move(head.part);
  entry.request_id = request_id;
  for (const auto& [key, bytes] : head.blobs) entry.blobs.push_back(key);
  entry.on_added = on_done;
  const bool is_posted =
      reader_.try_post([this, entry = std::move(entry), blobs = std::move(head.blobs)]() mutable {
        const std::string name = entry.session->name();
        absl::Status status;
        for (const auto& [key, bytes] : blobs) status.Update(store_->keep_blob(name, key, bytes));
        if (status.ok()) return enter_new(name, std::move(entry));
        const OnDone refused = std::move(entry.on_added);
        remove(name);  // lets go of the blobs
        services_.metrics->add(Count::kStoreErrors);
        refused(status);
      });
  if (!is_posted) on_done(server_busy(reader_.expected_wait()));
}

/// Its blobs are kept.
void Keeper::enter_new(const std::string& name, Entry entry) {
  const std::scoped_lock lock(mutex_);
  entries_[name] = std::move(entry);
  due(name);
  services_.timers->at(services_.timers->now() + kPatienceForNew, [weak = weak_from_this(), name] {
    if (const auto self = weak.lock()) self->give_up_new(name);
  });
}

void Keeper::give_up_new(const std::string& name) {
  OnDone on_done;
  {
    const std::scoped_lock lock(mutex_);
    const auto entry = entries_.find(name);
    if (entry == entries_.end() || !entry->second.on_added) return;
    on_done = std::exchange(entry->second.on_added, nullptr);
    entry->second.session.reset();  // it may be in the store already
    due(name);
  }
  on_done(store_failing("it is too slow"));
}

void Keeper::adopt(std::shared_ptr<Session> session, const StoredSession& stored) {
  const std::scoped_lock lock(mutex_);
  Entry& entry = entries_[session->name()];  // perhaps of one that is leaving: it comes back
  entry.is_leaving = false;
  entry.head = stored.parts.at("head");
  entry.epoch = stored.epoch;
  entry.revision = session->changes_since(std::numeric_limits<std::uint64_t>::max()).inputs.revision;
  entry.session = std::move(session);
}

void Keeper::changed(const Session& session, std::uint64_t revision, std::uint64_t epoch, OnKept on_kept) {
  bool is_kept = false;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = entries_.find(session.name());
    if (found != entries_.end() && found->second.session != nullptr) {
      Entry& entry = found->second;
      is_kept = entry.revision >= revision && entry.epoch >= epoch;
      if (!is_kept) {
        due(session.name());
        if (!is_failing_) {
          const Timers::TimePoint until = services_.timers->now() + kPatience;
          if (entry.waiting.empty()) watch(session.name(), until);
          entry.waiting.push_back({revision, epoch, until, Clock::now(), std::move(on_kept)});
          return;
        }
      }
    }
  }
  if (!is_kept) services_.metrics->add(Count::kUpdatesNotKept);
  on_kept(is_kept);
}

void Keeper::watch(const std::string& name, Timers::TimePoint when) {
  services_.timers->at(when, [weak = weak_from_this(), name] {
    if (const auto self = weak.lock()) self->give_up_waiting(name);
  });
}

/// Answers those that have waited for long enough.
void Keeper::give_up_waiting(const std::string& name) {
  std::vector<OnKept> late;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = entries_.find(name);
    if (found == entries_.end()) return;
    std::vector<Waiting>& waiting = found->second.waiting;
    const Timers::TimePoint now = services_.timers->now();
    std::erase_if(waiting, [&](Waiting& one) {
      const bool is_late = one.until <= now;
      if (is_late) late.push_back(std::move(one.on_kept));
      return is_late;
    });
    if (!waiting.empty()) watch(name, waiting.front().until);
  }
  services_.metrics->add(Count::kUpdatesNotKept, static_cast<double>(late.size()));
  for (const OnKept& on_kept : late) on_kept(false);
}

void Keeper::remove(const std::string& name, OnDone on_done) {
  const std::scoped_lock lock(mutex_);
  Entry& entry = entries_[name];
  entry.session.reset();
  entry.is_leaving = false;
  if (on_done) entry.on_removed.push_back(std::move(on_done));
  due(name);
}

void Keeper::release(const std::string& name) {
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(name);
  if (found == entries_.end() || found->second.session == nullptr) return;
  found->second.is_leaving = true;
  due(name);
}

bool Keeper::is_being_removed(const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(name);
  return found != entries_.end() && found->second.session == nullptr;
}

void Keeper::take_over(const std::string& name, const Asker& asker, OnFound on_found) {
  take_over_until(name, asker, services_.timers->now() + kPatienceForOthers, on_found);
}

void Keeper::take_over_until(const std::string& name, const Asker& asker, Timers::TimePoint end,
                             const OnFound& on_found) {
  const bool is_posted = reader_.try_post([this, name, asker, end, on_found] {
    absl::StatusOr<Found> found = is_being_removed(name) ? session_unknown() : read(name, asker);
    const Timers::TimePoint now = services_.timers->now();
    const Fault fault = fault_of(found.status());
    if (fault.reason != "SESSION_ELSEWHERE" || now >= end || leads_elsewhere(fault, asker.route))
      return on_found(std::move(found));
    services_.timers->at(now + kBetweenLooks, [weak = weak_from_this(), name, asker, end, on_found] {
      if (const auto self = weak.lock()) self->take_over_until(name, asker, end, on_found);
    });
  });
  if (!is_posted) on_found(server_busy(reader_.expected_wait()));
}

absl::StatusOr<Keeper::Found> Keeper::read(const std::string& name, const Asker& asker) {
  const Clock::time_point begin = Clock::now();
  auto session = store_->take_over(name, asker.owner, asker.route);
  absl::Status status = session.status();
  Found found;
  if (session.ok()) {
    found.session = *std::move(session);
    const auto head = decode_head(found.session.parts);
    status = head.status();
    for (const std::string& key : head.ok() ? blobs_of(head->request) : std::vector<std::string>()) {
      auto bytes = store_->blob(key);
      status.Update(bytes.status());
      if (bytes.ok()) found.blobs["blobs/" + key] = *std::move(bytes);
    }
  }
  services_.metrics->observe(Span::kStoreRead, seconds_since(begin));
  if (fault_of(status).reason == "STORE_FAILING") services_.metrics->add(Count::kStoreErrors);
  if (!status.ok()) return status;
  return found;
}

void Keeper::find_request(const std::string& owner, const std::string& request_id, OnName on_name) {
  const bool is_posted = reader_.try_post(
      [this, owner, request_id, on_name] { on_name(store_->find_request(owner, request_id)); });
  if (!is_posted) on_name(server_busy(reader_.expected_wait()));
}

void Keeper::list(const std::string& owner, const std::string& after, std::size_t most,
                  std::function<bool(const std::string&)> is_wanted, OnNames on_names) {
  const auto read = [this, owner, after, most, is_wanted = std::move(is_wanted), on_names] {
    std::vector<std::string> wanted;
    std::string last = after;
    for (bool has_more = true; has_more && wanted.size() < most;) {
      const auto names = store_->list(owner, last, most);
      if (!names.ok()) return on_names(names.status());
      has_more = names->size() == most;
      for (const std::string& name : *names) {
        if (wanted.size() < most && is_wanted(name) && !is_being_removed(name)) wanted.push_back(name);
      }
      if (!names->empty()) last = names->back();
    }
    on_names(std::move(wanted));
  };
  if (!reader_.try_post(read)) on_names(server_busy(reader_.expected_wait()));
}

void Keeper::flush(Clock::time_point end) {
  std::unique_lock lock(mutex_);
  changed_.wait_until(lock, end, [this] { return is_failing_ || (due_.empty() && !is_writing_); });
}

// The writer.

void Keeper::run() {
  std::unique_lock lock(mutex_);
  for (bool is_last_try = false;;) {
    if (is_failing_) changed_.wait_until(lock, retry_at_, [this] { return is_stopping_; });
    changed_.wait(lock, [this] { return is_stopping_ || !due_.empty(); });
    if (due_.empty() || is_last_try) return;
    is_last_try = is_stopping_;
    is_writing_ = true;
    lock.unlock();
    write(take_work());
    lock.lock();
    is_writing_ = false;
    changed_.notify_all();
  }
}

/// Everything that is due, as it is now.
std::vector<Keeper::Work> Keeper::take_work() {
  std::vector<Work> works;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::string& name : std::exchange(due_, {})) {
      const auto found = entries_.find(name);
      if (found == entries_.end()) continue;
      const Entry& entry = found->second;
      Work work{name, entry.session, entry.head, entry.revision, {}};
      work.change.session = name;
      work.change.epoch_before = entry.epoch;
      if (entry.epoch == 0) {
        work.change.request_id = entry.request_id;
        work.change.blobs = entry.blobs;
      }
      works.push_back(std::move(work));
    }
  }
  for (Work& work : works) fill_in(work);  // looks into sessions, which may be busy with an update
  return works;
}

void Keeper::fill_in(Work& work) {
  StoredChange& change = work.change;
  change.is_removal = work.session == nullptr;
  if (change.is_removal) return;
  const SessionChanges changes = work.session->changes_since(change.epoch_before == 0 ? 0 : work.revision);
  change.revision_before = work.revision;
  change.revision = work.revision = changes.inputs.revision;
  change.epoch = changes.lease.epoch;
  change.owner = work.session->owner();
  change.route = work.session->route();
  change.parts = encode_changes(changes);
  change.replaces_all = changes.inputs.is_all;
  if (change.replaces_all) change.parts["head"] = work.head;
}

/// All at once; where that fails, each by itself, so that one that cannot be kept does not hold up the others.
void Keeper::write(std::vector<Work> works) {
  Calls calls;
  auto outcomes = commit(works);
  absl::Status health = outcomes.status();
  for (std::size_t k = 0; k < works.size(); ++k) {
    const std::span<const Work> one(&works[k], 1);
    const bool is_alone = !outcomes.ok() && works.size() > 1;
    const auto again = is_alone ? commit(one) : outcomes;
    if (is_alone) health = k == 0 ? again.status() : (health.Update(again.status()), health);
    const std::scoped_lock lock(mutex_);
    if (again.ok()) {
      note_kept(works[k], (*again)[is_alone ? 0 : k], calls);
    } else {
      note_failed(works[k], again.status(), calls);
    }
  }
  {
    const std::scoped_lock lock(mutex_);
    note_health(health);
  }
  for (const auto& call : calls) call();
}

absl::StatusOr<std::vector<ChangeOutcome>> Keeper::commit(std::span<const Work> works) {
  std::vector<StoredChange> changes;
  for (const Work& work : works) changes.push_back(work.change);
  const Clock::time_point begin = Clock::now();
  auto outcomes = store_->commit(changes);
  services_.metrics->observe(Span::kStoreWrite, seconds_since(begin));
  if (!outcomes.ok()) services_.metrics->add(Count::kStoreErrors);
  return outcomes;
}

/// Under the lock; what is to be called afterwards goes into `calls`.
void Keeper::note_kept(const Work& work, ChangeOutcome outcome, Calls& calls) {
  const auto found = entries_.find(work.name);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  if (entry.session != nullptr && work.session != nullptr && entry.session != work.session)
    return;  // it left and came back meanwhile: what was written is of an epoch before
  if (work.change.is_removal || outcome == ChangeOutcome::kFenced) {
    for (OnDone& on_removed : entry.on_removed)
      calls.emplace_back([on_removed = std::move(on_removed)] { on_removed(absl::OkStatus()); });
    answer_all(entry, calls);
    if (entry.session != nullptr && on_lost)
      calls.emplace_back([this, lost = entry.session] { on_lost(*lost); });
    due_.erase(work.name);
    entries_.erase(found);
    return;
  }
  if (outcome == ChangeOutcome::kBehind) return write_all(entry, work.name);
  entry.revision = work.revision;
  entry.epoch = work.change.epoch;
  if (entry.on_added)
    calls.emplace_back([on_added = std::exchange(entry.on_added, nullptr)] { on_added(absl::OkStatus()); });
  answer_kept(entry, calls);
  if (entry.is_leaving && !due_.contains(work.name)) {
    entries_.erase(found);
    calls.emplace_back([this, name = work.name] { store_->let_go(name).IgnoreError(); });
  }
}

/// Under the lock. The store lost what it had called kept, and this process has it yet.
void Keeper::write_all(Entry& entry, const std::string& name) {
  entry.revision = 0;
  due(name);
  services_.log->warning("store_went_back", {{"session", abbreviated(name)},
                                             {"text", "The session is written again, in whole."}});
}

/// Under the lock. What has changed stays due; a new session is given up.
void Keeper::note_failed(const Work& work, const absl::Status& why, Calls& calls) {
  const auto found = entries_.find(work.name);
  if (found == entries_.end()) return;
  Entry& entry = found->second;
  if (entry.on_added) {
    calls.emplace_back([on_added = std::exchange(entry.on_added, nullptr), why] { on_added(why); });
    entry.session.reset();  // the store may have it all the same
  }
  for (OnDone& on_removed : std::exchange(entry.on_removed, {}))
    calls.emplace_back([on_removed = std::move(on_removed), why] { on_removed(why); });
  services_.metrics->add(Count::kUpdatesNotKept, static_cast<double>(entry.waiting.size()));
  answer_all(entry, calls);
  due_.insert(work.name);
}

/// Those whose updates are kept.
void Keeper::answer_kept(Entry& entry, Calls& calls) {
  std::erase_if(entry.waiting, [&](Waiting& one) {
    const bool is_kept = one.revision <= entry.revision && one.epoch <= entry.epoch;
    if (!is_kept) return false;
    services_.metrics->observe(Span::kInputToKept, seconds_since(one.since));
    calls.emplace_back([on_kept = std::move(one.on_kept)] { on_kept(true); });
    return true;
  });
}

void Keeper::answer_all(Entry& entry, Calls& calls) {
  for (Waiting& one : std::exchange(entry.waiting, {}))
    calls.emplace_back([on_kept = std::move(one.on_kept)] { on_kept(false); });
}

/// Under the lock.
void Keeper::note_health(const absl::Status& status) {
  const bool was_failing = std::exchange(is_failing_, !status.ok());
  services_.metrics->set(Level::kStoreFailing, is_failing_ ? 1 : 0);
  if (is_failing_) {
    pause_ = was_failing ? std::min<Clock::duration>(2 * pause_, kLongestPause) : kFirstPause;
    retry_at_ = Clock::now() + pause_;
    if (!was_failing) services_.log->warning("store_failing", {{"text", std::string(status.message())}});
  } else if (was_failing) {
    services_.log->info("store_works", {{"text", "What was not kept is now."}});
  }
}

// Sessions that nobody uses.

void Keeper::watch_unused() {
  const Timers::Duration sweep = services_.idle / kSweepsPerIdle;
  const Timers::Duration touch = store_->touch_every();
  const bool is_hasty = touch.count() > 0 && touch < sweep;
  services_.timers->at(services_.timers->now() + (is_hasty ? touch : sweep), [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->sweep();
  });
}

void Keeper::sweep() {
  const auto touched = [this] {  // its thread ends before this does
    touch_all();
    watch_unused();
  };
  if (!reader_.try_post(touched)) watch_unused();
}

/// On the reader's thread.
void Keeper::touch_all() {
  std::vector<TouchedSession> sessions;
  const Timers::TimePoint now = services_.timers->now();
  bool is_sweep = false;
  {
    const std::scoped_lock lock(mutex_);
    is_sweep = now >= next_sweep_;
    for (const auto& [name, entry] : entries_) {
      if (entry.session == nullptr || entry.epoch == 0 || entry.is_leaving) continue;
      sessions.push_back({name, entry.epoch, now - entry.session->last_used() < kInUse, entry.revision});
    }
  }
  const auto touched = store_->touch(sessions);
  if (touched.ok()) drop(touched->lost);
  if (touched.ok()) write_again(touched->behind);
  if (touched.ok()) hand_over(touched->wanted);
  absl::Status status = touched.status();
  if (is_sweep && status.ok()) {
    const auto idle_ms = std::chrono::duration_cast<std::chrono::milliseconds>(services_.idle).count();
    status = store_->remove_unused(idle_ms).status();
    const std::scoped_lock lock(mutex_);
    next_sweep_ = now + services_.idle / kSweepsPerIdle;
  }
  if (!status.ok()) services_.metrics->add(Count::kStoreErrors);
}

void Keeper::write_again(const std::vector<std::string>& names) {
  const std::scoped_lock lock(mutex_);
  for (const std::string& name : names) {
    const auto found = entries_.find(name);
    if (found != entries_.end() && found->second.session != nullptr) write_all(found->second, name);
  }
}

/// Their callers come by another process now, where one of them waits already.
void Keeper::hand_over(const std::vector<std::string>& names) {
  Calls calls;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::string& name : names) {
      const auto found = entries_.find(name);
      if (found == entries_.end() || found->second.session == nullptr || !on_lost) continue;
      calls.emplace_back([this, session = found->second.session] { on_lost(*session); });
    }
  }
  for (const auto& call : calls) call();  // whoever has them releases them
}

/// Sessions that another process has now.
void Keeper::drop(const std::vector<std::string>& lost) {
  Calls calls;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::string& name : lost) {
      const auto found = entries_.find(name);
      if (found == entries_.end() || found->second.session == nullptr) continue;
      answer_all(found->second, calls);
      if (on_lost) calls.emplace_back([this, session = found->second.session] { on_lost(*session); });
      due_.erase(name);
      entries_.erase(found);
    }
  }
  for (const auto& call : calls) call();
}

}  // namespace lpdeform
