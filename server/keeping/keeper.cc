#include "server/keeping/keeper.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/runtime/refusals.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestQueue = 4096;
/// How often to check whether another process has released a session.
constexpr std::chrono::milliseconds kBetweenLooks{50};
/// The size assumed for a mesh that is read, because it is not known beforehand; it sets how long the store
/// may take.
constexpr std::size_t kLargeBlob = std::size_t{32} << 20;

/// Whether the session has another route than the caller. Then waiting here does not help.
bool leads_elsewhere(const Fault& fault, const std::string& route) {
  return !fault.limit.empty() && fault.limit != route_header(route);
}

}  // namespace

Keeper::Keeper(std::shared_ptr<Store> store, Services services)
    : store_(std::move(store)), services_(std::move(services)), reader_(1, kLongestQueue), toucher_(1, 1) {
  writer_ = std::thread([this] { run(); });
}

std::shared_ptr<Keeper> Keeper::create(std::shared_ptr<Store> store, Services services) {
  std::shared_ptr<Keeper> keeper(new Keeper(std::move(store), std::move(services)));
  keeper->watch_unused();
  // The first touch is made at once: an outage of the store ends when a server starts.
  static_cast<void>(keeper->toucher_.try_post([one = keeper.get()] { one->touch_all(); }));
  keeper->watch_room();
  keeper->watch_calls();
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

/// OK, or the reason not to ask the store: it does not answer at the moment, or the caller has waited for too
/// long.
absl::Status Keeper::check_store_answers(Clock::time_point since) const {
  if (Clock::now() - since > kPatienceForNew) return store_failing("it is too slow");
  const std::scoped_lock lock(mutex_);
  return is_hanging_ || is_stuck_ ? store_away("it does not answer") : absl::OkStatus();
}

/// Asks the store, on the reader's thread. `since`: when the caller began to wait. `bytes`: the size of the
/// answer, at most.
template <typename Ask>
std::invoke_result_t<Ask> Keeper::ask(Clock::time_point since, const Ask& what, std::size_t bytes) {
  if (absl::Status status = check_store_answers(since); !status.ok()) return status;
  const Clock::time_point begin = Clock::now();
  auto answer = [&] {
    const StoreCalls::UnderWay call(calls_, begin, bytes);
    return what();
  }();
  note_read(answer.status(), begin);
  return answer;
}

/// Called with the lock held.
void Keeper::due(const std::string& name) {
  due_.insert(name);
  const auto found = entries_.find(name);
  has_fresh_ = has_fresh_ || found == entries_.end() || !found->second.is_refused;
  changed_.notify_all();
}

void Keeper::add(std::shared_ptr<Session> session, StoredHead head, const std::string& request_id,
                 OnDone on_done) {
  if (is_failing()) return on_done(store_failing("it has not taken the last change yet"));
  Entry entry;
  entry.session = std::move(session);
  entry.head = std::move(head.part);
  entry.request_id = request_id;
  for (const auto& [key, bytes] : head.blobs) entry.blobs.push_back(key);
  const std::string name = entry.session->name();
  const WaitingCallers::Id caller = callers_.add(on_done);
  const OnDone on_added = [this, name, caller, on_done = std::move(on_done)](const absl::Status& status) {
    if (callers_.take(caller)) return on_done(status);
    if (status.ok()) remove(name);  // its caller was told meanwhile that there is no session
  };
  entry.on_added = on_added;
  const bool is_posted = reader_.try_post(
      [this, name, entry = std::move(entry), blobs = std::move(head.blobs), since = Clock::now()]() mutable {
        absl::Status status;
        for (const auto& [key, bytes] : blobs) {
          if (status.ok()) status = keep_blob(since, name, key, bytes);
          since = Clock::now();  // a large one may take longer
        }
        if (status.ok()) return enter_new(name, std::move(entry));
        const OnDone refused = std::move(entry.on_added);
        remove(name);  // releases the blobs
        refused(status);
      });
  if (!is_posted) on_added(server_busy(reader_.expected_wait()));
}

/// A store that is too full for a blob still answers, so it is not failing. Whether it takes changes is found
/// out when changes are written.
absl::Status Keeper::keep_blob(Clock::time_point since, const std::string& name, const std::string& key,
                               const std::string& bytes) {
  if (absl::Status status = check_store_answers(since); !status.ok()) return status;
  const Clock::time_point begin = Clock::now();
  const absl::Status status = [&] {
    const StoreCalls::UnderWay call(calls_, begin, bytes.size());
    return store_->keep_blob(name, key, bytes);
  }();
  if (status.ok() || is_away(status)) {
    note_read(status, begin);
  } else {
    services_.metrics->add(Count::kStoreErrors);
    const std::scoped_lock lock(mutex_);
    note_full(status);
  }
  return status;
}

/// Enters a session whose blobs are stored.
void Keeper::enter_new(const std::string& name, Entry entry) {
  std::unique_lock lock(mutex_);
  if (is_over_) {
    lock.unlock();
    return entry.on_added(store_failing(kEnds));
  }
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
    entry->second.is_refused = false;
    entry->second.session.reset();  // the store may have the session already
    due(name);
  }
  on_done(store_failing("it is too slow"));
}

void Keeper::adopt(std::shared_ptr<Session> session, const StoredSession& stored) {
  Calls calls;
  {
    const std::scoped_lock lock(mutex_);
    being_made_.erase(session->name());
    Entry& entry = entries_[session->name()];  // may be the entry of a session that is leaving; it comes back
    answer_all(entry, calls);                  // revisions of the old session mean nothing to the new one
    entry.is_leaving = entry.is_lost = entry.is_refused = false;
    entry.head = stored.parts.at("head");
    entry.epoch = stored.epoch;
    const SessionChanges none = session->changes_since(std::numeric_limits<std::uint64_t>::max());
    entry.revision = none.inputs.revision;
    entry.input_seq = none.lease.input_seq;
    entry.session = std::move(session);
  }
  make(calls);
}

void Keeper::give_up(const std::string& name) {
  std::uint64_t epoch = 0;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = being_made_.find(name);
    if (found == being_made_.end()) return;
    epoch = found->second;
    being_made_.erase(found);
  }
  // If this is not done, the session is free when the lease ends.
  static_cast<void>(reader_.try_post([this, name, epoch] {
    store_->release({{name, epoch}}).IgnoreError();
  }));
}

void Keeper::changed(const Session& session, std::uint64_t revision, std::uint64_t epoch, OnKept on_kept) {
  bool is_kept = false;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = entries_.find(session.name());
    if (found != entries_.end() && found->second.session.get() == &session) {
      Entry& entry = found->second;
      is_kept = entry.revision >= revision && entry.epoch >= epoch;
      if (!is_kept && !is_over_) {
        due(session.name());
        if (!is_writing_failing_ && !is_stuck_ && !entry.is_refused) {
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

/// Answers the updates that have waited for too long.
void Keeper::give_up_waiting(const std::string& name) {
  std::vector<Waiting> late;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = entries_.find(name);
    if (found == entries_.end()) return;
    std::vector<Waiting>& waiting = found->second.waiting;
    const Timers::TimePoint now = services_.timers->now();
    std::erase_if(waiting, [&](Waiting& one) {
      const bool is_late = one.until <= now;
      if (is_late) late.push_back(std::move(one));
      return is_late;
    });
    if (!waiting.empty()) watch(name, waiting.front().until);
  }
  note_slow(late.size());
  for (const Waiting& one : late) {
    note_waited(one);
    one.on_kept(false);
  }
}

void Keeper::remove(const std::string& name, OnDone on_done) {
  std::unique_lock lock(mutex_);
  if (is_over_) {
    lock.unlock();
    if (on_done) on_done(store_failing(kEnds));
    return;
  }
  Entry& entry = entries_[name];
  entry.session.reset();
  entry.is_leaving = entry.is_expired = entry.is_refused = false;
  if (on_done) entry.on_removed.push_back(answered_once(std::move(on_done)));
  due(name);
}

void Keeper::expire(const Session& session) {
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(session.name());
  if (found == entries_.end() || found->second.session.get() != &session) return;
  found->second.session.reset();
  found->second.is_leaving = found->second.is_refused = false;
  found->second.is_expired = true;
  due(session.name());
}

void Keeper::release(const Session& session) {
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(session.name());
  if (found == entries_.end() || found->second.session.get() != &session) return;
  found->second.is_leaving = true;
  due(session.name());
}

/// Whether the session is leaving this process and its changes are about to be written. If the store fails,
/// its own error says more.
bool Keeper::is_leaving(const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(name);
  return found != entries_.end() && found->second.session != nullptr && !is_writing_failing_;
}

bool Keeper::is_failing() const {
  const std::scoped_lock lock(mutex_);
  return is_writing_failing_ || is_reading_failing_ || is_stuck_;
}

absl::Status Keeper::may_keep(const Session& session) const {
  if (is_failing()) return store_failing("it has not taken the last change yet");
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(session.name());
  const bool is_refused = found != entries_.end() && found->second.is_refused;
  return is_refused ? store_full("it has not taken the last change of the session") : absl::OkStatus();
}

bool Keeper::is_being_removed(const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  const auto found = entries_.find(name);
  return found != entries_.end() && found->second.session == nullptr;
}

void Keeper::take_over(const std::string& name, const Asker& asker, OnFound on_found) {
  const WaitingCallers::Id caller = callers_.add(on_found);
  const OnFound once = [this, name, caller, on_found = std::move(on_found)](absl::StatusOr<Found> found) {
    if (callers_.take(caller)) return on_found(std::move(found));
    if (found.ok()) give_up(name);  // its caller was told meanwhile that the store does not answer
  };
  take_over_until(name, asker, services_.timers->now() + kPatienceForOthers, once);
}

void Keeper::take_over_until(const std::string& name, const Asker& asker, Timers::TimePoint end,
                             const OnFound& on_found) {
  const bool is_posted = reader_.try_post([this, name, asker, end, on_found, since = Clock::now()] {
    absl::StatusOr<Found> found = find(name, asker, since);
    const Timers::TimePoint now = services_.timers->now();
    const Fault fault = fault_of(found.status());
    if (fault.reason != Reason::kSessionElsewhere || now >= end || leads_elsewhere(fault, asker.route))
      return on_found(std::move(found));
    services_.timers->at(now + kBetweenLooks, [weak = weak_from_this(), name, asker, end, on_found] {
      if (const auto self = weak.lock()) self->take_over_until(name, asker, end, on_found);
    });
  });
  if (!is_posted) on_found(server_busy(reader_.expected_wait()));
}

absl::StatusOr<Keeper::Found> Keeper::find(const std::string& name, const Asker& asker,
                                           Clock::time_point since) {
  if (is_being_removed(name)) return session_unknown();
  if (is_leaving(name)) return session_elsewhere();
  return read(name, asker, since);
}

absl::StatusOr<Keeper::Found> Keeper::read(const std::string& name, const Asker& asker,
                                           Clock::time_point since) {
  const Clock::time_point begin = Clock::now();
  auto session = ask(since, [&] { return store_->take_over(name, asker.owner, asker.route); });
  absl::Status status = session.status();
  Found found;
  if (session.ok()) {
    found.session = *std::move(session);
    {
      const std::scoped_lock lock(mutex_);
      being_made_[name] = found.session.epoch;
    }
    const auto head = decode_head(found.session.parts);
    status = head.status();
    for (const std::string& key : head.ok() ? blobs_of(head->request) : std::vector<std::string>()) {
      auto bytes = ask(
          Clock::now(), [&] { return store_->blob(key); }, kLargeBlob);
      status.Update(bytes.status());
      if (bytes.ok()) found.blobs["blobs/" + key] = *std::move(bytes);
    }
  }
  services_.metrics->observe(Span::kStoreRead, std::chrono::duration<double>(Clock::now() - begin).count());
  if (status.ok()) return found;
  give_up(name);
  return status;
}

/// Calls `on_answer` unless the caller was answered already because the store did not answer.
template <typename Answer>
std::function<void(Answer)> Keeper::answered_once(std::function<void(Answer)> on_answer) {
  const WaitingCallers::Id caller = callers_.add(on_answer);
  return [this, caller, on_answer = std::move(on_answer)](Answer answer) {
    if (callers_.take(caller)) on_answer(std::move(answer));
  };
}

void Keeper::find_request(const std::string& owner, const std::string& request_id, OnName on_name) {
  on_name = answered_once(std::move(on_name));
  const bool is_posted = reader_.try_post([this, owner, request_id, on_name, since = Clock::now()] {
    on_name(ask(since, [&] { return store_->find_request(owner, request_id); }));
  });
  if (!is_posted) on_name(server_busy(reader_.expected_wait()));
}

void Keeper::list(const std::string& owner, const std::string& after, std::size_t most,
                  std::function<bool(const std::string&)> is_wanted, OnNames on_names) {
  on_names = answered_once(std::move(on_names));
  const auto read = [this, owner, after, most, is_wanted = std::move(is_wanted), on_names,
                     since = Clock::now()] {
    std::vector<std::string> wanted;
    std::string last = after;
    for (bool has_more = true; has_more && wanted.size() < most;) {
      const auto names = ask(since, [&] { return store_->list(owner, last, most); });
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

}  // namespace lpdeform
