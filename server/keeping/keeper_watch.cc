// Keeper: tells the store which sessions this process has, learns which of them other processes have or want,
// and removes unused sessions.

#include <utility>

#include "server/keeping/keeper.h"

namespace lpdeform {
namespace {

/// How often unused sessions are looked for within the idle time.
constexpr int kSweepsPerIdle = 8;
/// How often to retry a store that fails to answer reads.
constexpr Timers::Duration kBetweenTries = std::chrono::seconds(1);
/// How often to ask a store for its figures.
constexpr Timers::Duration kBetweenFigures = std::chrono::seconds(5);

}  // namespace

void Keeper::watch_unused() {
  const Timers::Duration sweep = services_.idle / kSweepsPerIdle;
  const Timers::Duration touch = store_->touch_every();
  const bool is_hasty = touch.count() > 0 && touch < sweep;
  services_.timers->at(services_.timers->now() + (is_hasty ? touch : sweep), [weak = weak_from_this()] {
    if (const auto self = weak.lock()) self->sweep();
  });
}

/// Called with the lock held. Retries until the store answers reads again: without callers nothing else would
/// notice.
void Keeper::try_again_later() {
  if (std::exchange(is_trying_again_, true)) return;
  services_.timers->at(services_.timers->now() + kBetweenTries, [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (self == nullptr) return;
    {
      const std::scoped_lock lock(self->mutex_);
      self->is_trying_again_ = false;
      if (!self->is_reading_failing_) return;
      self->try_again_later();
    }
    // If a touch is under way already, it serves the same purpose.
    static_cast<void>(self->toucher_.try_post([keeper = self.get()] { keeper->touch_all(); }));
  });
}

void Keeper::sweep() {
  const auto touched = [this] {  // the toucher's thread ends before this object does
    touch_all();
    watch_unused();
  };
  if (!toucher_.try_post(touched)) watch_unused();
}

/// Called on the toucher's thread.
void Keeper::touch_all() {
  std::vector<TouchedSession> sessions;
  Sessions touched_ones;
  const Timers::TimePoint now = services_.timers->now();
  bool is_sweep = false;
  {
    const std::scoped_lock lock(mutex_);
    is_sweep = now >= next_sweep_;
    for (const auto& [name, entry] : entries_) {
      if (entry.session == nullptr || entry.epoch == 0 || entry.is_leaving) continue;
      const bool is_in_use = entry.session->has_streams() || now - entry.session->last_used() < kInUse;
      sessions.push_back({name, entry.epoch, is_in_use, entry.revision});
      touched_ones[name] = entry.session;
    }
    for (const auto& [name, epoch] : being_made_) sessions.push_back({name, epoch, true, 0, true});
  }
  const Clock::time_point begin = Clock::now();
  const auto touched = [&] {
    const StoreCalls::UnderWay call(calls_, begin);
    return store_->touch(sessions);
  }();
  note_read(touched.status(), begin);
  {
    const std::scoped_lock lock(mutex_);
    note_full(touched.status());
  }
  if (touched.ok()) drop(touched->lost, touched_ones);
  if (touched.ok()) write_again(*touched, touched_ones);
  if (touched.ok()) hand_over(touched->wanted, touched_ones);
  if (touched.ok() && now >= next_figures_) show_figures(now);
  if (is_sweep && (touched.ok() || is_full(touched.status()))) {
    const auto idle_ms = std::chrono::duration_cast<std::chrono::milliseconds>(services_.idle).count();
    if (!store_->remove_unused(idle_ms).ok()) services_.metrics->add(Count::kStoreErrors);
    const std::scoped_lock lock(mutex_);
    next_sweep_ = now + services_.idle / kSweepsPerIdle;
  }
}

/// A user who may not ask Redis for figures can still store sessions, so an error is ignored.
void Keeper::show_figures(Timers::TimePoint now) {
  next_figures_ = now + kBetweenFigures;
  const auto told = store_->figures();
  if (!told.ok() || !*told) return;
  const StoreFigures& figures = **told;
  for (const auto& [level, value] :
       {std::pair(Level::kRedisMemory, figures.memory_bytes),
        std::pair(Level::kRedisMemoryMost, figures.memory_limit_bytes),
        std::pair(Level::kRedisEvicted, figures.evicted), std::pair(Level::kRedisClients, figures.clients),
        std::pair(Level::kRedisClientsRefused, figures.clients_refused),
        std::pair(Level::kRedisReplicas, figures.replicas),
        std::pair(Level::kRedisSyncsDelayed, figures.syncs_delayed),
        std::pair(Level::kRedisInMemoryAlone, figures.is_in_memory_alone ? 1.0 : 0.0),
        std::pair(Level::kRedisPersistenceFailing, figures.is_persistence_failing ? 1.0 : 0.0)})
    services_.metrics->set(level, value);
}

/// Checks the store's room periodically, on the toucher's thread.
void Keeper::watch_room() {
  services_.timers->at(services_.timers->now() + kBetweenFigures, [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (self == nullptr) return;
    static_cast<void>(self->toucher_.try_post([keeper = self.get()] { keeper->show_room(); }));
    self->watch_room();
  });
}

void Keeper::show_room() {
  const std::optional<StoreRoom> room = store_->room();
  if (room) {
    services_.metrics->set(Level::kStoreFree, room->free_bytes);
    services_.metrics->set(Level::kStoreLimit, room->limit_bytes);
  }
  const std::scoped_lock lock(mutex_);
  if (is_full_ || (room && room->is_full) || !std::exchange(was_full_, false)) return;
  services_.metrics->set(Level::kStoreFull, 0);
  services_.log->info("store_has_room", {{"text", "The store has room again for new data."}});
}

void Keeper::watch_calls() {
  services_.timers->at(services_.timers->now() + kBetweenTries, [weak = weak_from_this()] {
    const auto self = weak.lock();
    if (self == nullptr) return;
    self->look_at_calls();
    self->watch_calls();
  });
}

/// Answers the callers who wait for a call that does not return. The call itself goes on.
void Keeper::look_at_calls() {
  const bool is_late = calls_.is_any_late(Clock::now());
  const absl::Status away = store_away("it does not answer");
  {
    const std::scoped_lock lock(mutex_);
    is_stuck_ = is_late;
    note_health(is_late ? away : absl::OkStatus());
  }
  if (is_late) callers_.refuse_all(away);
}

/// Called with the lock held. Null if the touched session has left meanwhile, or was replaced by another of
/// its name.
Keeper::Entry* Keeper::same_entry(const std::string& name, const Sessions& touched) {
  const auto found = entries_.find(name);
  const auto before = touched.find(name);
  const bool is_same =
      found != entries_.end() && before != touched.end() && found->second.session == before->second;
  return is_same ? &found->second : nullptr;
}

void Keeper::write_again(const TouchResult& result, const Sessions& touched) {
  const std::scoped_lock lock(mutex_);
  for (const std::string& name : result.behind) {
    if (Entry* const entry = same_entry(name, touched)) write_all(*entry, name);
  }
  for (const std::string& name : result.missing) {
    if (Entry* const entry = same_entry(name, touched)) rewrite(*entry, name);
  }
}

/// Releases sessions that another process wants, because a caller with their route waits there.
void Keeper::hand_over(const std::vector<std::string>& names, const Sessions& touched) {
  Calls calls;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::string& name : names) {
      const Entry* const entry = same_entry(name, touched);
      if (entry == nullptr || !on_lost) continue;
      services_.log->info("session_handed_over", {{"session", abbreviated(name)}, {"epoch", entry->epoch}});
      calls.add([this, session = entry->session] { on_lost(*session); });
    }
  }
  make(calls);  // the callback releases the sessions
}

/// Drops sessions that another process has taken over.
void Keeper::drop(const std::vector<std::string>& lost, const Sessions& touched) {
  Calls calls;
  {
    const std::scoped_lock lock(mutex_);
    for (const std::string& name : lost) {
      Entry* const entry = same_entry(name, touched);
      if (entry == nullptr) continue;
      services_.log->info("session_lost", {{"session", abbreviated(name)}, {"epoch", entry->epoch}});
      answer_all(*entry, calls);
      if (on_lost) calls.add([this, session = entry->session] { on_lost(*session); });
      due_.erase(name);
      entries_.erase(name);
    }
  }
  make(calls);
}

}  // namespace lpdeform
