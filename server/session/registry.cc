#include "server/session/registry.h"

#include <algorithm>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/runtime/refusals.h"
#include "server/runtime/upload.h"

namespace lpdeform {
namespace {

constexpr std::chrono::seconds kShortestAdvice{5}, kLongestAdvice{15};

}  // namespace

Registry::Registry(std::shared_ptr<Timers> timers, Limits limits)
    : timers_(std::move(timers)), limits_(limits) {}

bool Registry::begin_creation(const std::string& request_id, OnCreated on_created, std::size_t fingerprint,
                              const std::string& owner) {
  if (absl::Status status = check_request_id(request_id); !status.ok()) {
    on_created(status);
    return false;
  }
  std::unique_lock lock(mutex_);
  if (const auto known = requests_.find({owner, request_id}); known != requests_.end()) {
    if (known->second.fingerprint != fingerprint) {
      lock.unlock();
      on_created(request_id_reused());
      return false;
    }
    if (known->second.name.empty()) {
      known->second.waiting.push_back(std::move(on_created));
      return false;
    }
    const CreatedSession created{sessions_.at(known->second.name).session, known->second.writer_token};
    lock.unlock();
    created.session->touch();
    on_created(created);
    return false;
  }
  if (absl::Status status = check_room(owner); !status.ok()) {
    lock.unlock();
    on_created(status);
    return false;
  }
  ++being_made_;
  ++held_[owner];
  if (!request_id.empty()) {
    Request& made = requests_[{owner, request_id}];
    made.fingerprint = fingerprint;
    made.waiting.push_back(std::move(on_created));
  }
  return true;
}

absl::Status Registry::check_room(const std::string& owner) const {
  if (sessions_.size() + being_made_ >= limits_.most_sessions) {
    return retry_after(
        make_fault({Reason::kSessionsFull, "sessions", absl::StrCat("sessions <= ", limits_.most_sessions)},
                   absl::StrCat("The server has all of its ", limits_.most_sessions,
                                " sessions in use; try again after the time given.")),
        until_one_expires());
  }
  const auto held = held_.find(owner);
  if (owner.empty() || limits_.most_each == 0 || held == held_.end() || held->second < limits_.most_each) {
    return absl::OkStatus();
  }
  return make_fault(
      {Reason::kCallerSessionsFull, "sessions", absl::StrCat("sessions <= ", limits_.most_each)},
      absl::StrCat("The caller has all of the ", limits_.most_each,
                   " sessions that one caller may have; delete one first."));
}

/// Time until the next unused session expires, within 5 to 15 s: many sessions are deleted long before they expire.
std::chrono::duration<double> Registry::until_one_expires() const {
  Timers::Duration soonest = kLongestAdvice;
  for (const auto& [name, entry] : sessions_)
    soonest = std::min(soonest, entry.session->last_used() + limits_.idle - timers_->now());
  return std::max<Timers::Duration>(soonest, kShortestAdvice);
}

void Registry::give_up_place(const std::string& owner) {
  const auto held = held_.find(owner);
  if (--held->second == 0) held_.erase(held);
}

void Registry::finish_creation(const std::string& request_id, absl::StatusOr<std::shared_ptr<Session>> made,
                               const OnCreated& on_created, const std::string& owner) {
  absl::StatusOr<CreatedSession> created =
      made.ok() ? absl::StatusOr<CreatedSession>(CreatedSession{*made, (*made)->lease().token})
                : made.status();
  std::vector<OnCreated> waiting;
  {
    const std::scoped_lock lock(mutex_);
    --being_made_;
    if (!request_id.empty()) {
      Request& request = requests_[{owner, request_id}];
      waiting.swap(request.waiting);
      if (made.ok()) {
        request.name = (*made)->name();
        request.writer_token = created->writer_token;
      } else {
        requests_.erase({owner, request_id});
      }
    }
    if (!made.ok()) give_up_place(owner);
    if (made.ok()) enter(*made, request_id);
  }
  if (request_id.empty()) on_created(created);
  for (const OnCreated& one : waiting) one(created);
}

/// Called with the lock held.
void Registry::enter(const std::shared_ptr<Session>& session, const std::string& request_id) {
  const std::string& name = session->name();
  left_.erase(name);
  sessions_[name] = {session, request_id, ++numbers_};
  by_age_[numbers_] = name;
  watch(name, timers_->now() + limits_.idle);
}

absl::Status Registry::begin_restoring(const std::string& owner) {
  const std::scoped_lock lock(mutex_);
  if (absl::Status status = check_room(owner); !status.ok()) return status;
  ++being_made_;
  ++held_[owner];
  return absl::OkStatus();
}

void Registry::finish_restoring(const std::string& owner,
                                const absl::StatusOr<std::shared_ptr<Session>>& made,
                                const std::string& request_id, std::size_t fingerprint) {
  const std::scoped_lock lock(mutex_);
  --being_made_;
  if (!made.ok()) return give_up_place(owner);
  if (!request_id.empty()) {
    requests_[{owner, request_id}] = {fingerprint, (*made)->name(), (*made)->lease().token, {}};
  }
  enter(*made, request_id);
}

bool Registry::has(const std::string& name) const {
  const std::scoped_lock lock(mutex_);
  return sessions_.contains(name);
}

absl::StatusOr<std::shared_ptr<Session>> Registry::find(const std::string& name,
                                                        const std::string& owner) const {
  {
    const std::scoped_lock lock(mutex_);
    const auto found = sessions_.find(name);
    if (found != sessions_.end() && found->second.session->owner() == owner) {
      found->second.session->touch();
      return found->second.session;
    }
    const auto left = left_.find(name);
    if (left != left_.end() && left->second.owner == owner && timers_->now() < left->second.until)
      return session_elsewhere();
  }
  return session_unknown();
}

absl::StatusOr<Registry::Page> Registry::list(std::size_t most, const std::string& page_token,
                                              const std::string& owner) const {
  std::uint64_t before = 0;
  if (!page_token.empty() && !absl::SimpleAtoi(page_token, &before)) {
    return make_fault({Reason::kPageToken, "page_token", ""}, "This server did not issue the page token.");
  }
  const std::scoped_lock lock(mutex_);
  Page page;
  auto entry = page_token.empty() ? by_age_.end() : by_age_.lower_bound(before);
  std::uint64_t last = 0;  // the number of the last session on the page
  while (entry != by_age_.begin()) {
    --entry;
    const std::shared_ptr<Session>& session = sessions_.at(entry->second).session;
    if (session->owner() != owner) continue;
    if (page.sessions.size() == most) {
      page.next_page_token = absl::StrCat(last);
      break;
    }
    last = entry->first;
    page.sessions.push_back(session);
  }
  return page;
}

bool Registry::remove(const std::string& name, EndReason reason, const std::string& text) {
  return remove_one(name, nullptr, reason, text);
}

bool Registry::remove(const Session& session, EndReason reason, const std::string& text) {
  return remove_one(session.name(), &session, reason, text);
}

/// Called with the lock held.
void Registry::note_left(const Session& session) {
  const Timers::TimePoint now = timers_->now();
  std::erase_if(left_, [now](const auto& left) { return left.second.until <= now; });
  left_[session.name()] = {session.owner(), now + kLeaving};
}

void Registry::forget_left(const std::string& name) {
  const std::scoped_lock lock(mutex_);
  left_.erase(name);
}

bool Registry::remove_one(const std::string& name, const Session* only, EndReason reason,
                          const std::string& text) {
  std::shared_ptr<Session> session;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = sessions_.find(name);
    if (found == sessions_.end() || (only != nullptr && found->second.session.get() != only)) return false;
    session = found->second.session;
    if (goes_on(reason)) note_left(*session);
    by_age_.erase(found->second.number);
    requests_.erase({session->owner(), found->second.request_id});
    give_up_place(session->owner());
    sessions_.erase(found);
  }
  session->close(reason, text);
  if (on_ended) on_ended(*session, reason);
  return true;
}

void Registry::drain(const std::string& text) {
  std::vector<std::shared_ptr<Session>> all;
  {
    const std::scoped_lock lock(mutex_);
    for (const auto& [name, entry] : sessions_) all.push_back(entry.session);
  }
  for (const auto& session : all) session->drain(text);
}

void Registry::clear(EndReason reason, const std::string& text) {
  std::map<std::string, Entry> all;
  {
    const std::scoped_lock lock(mutex_);
    all.swap(sessions_);
    by_age_.clear();
    for (const auto& [name, entry] : all) {
      give_up_place(entry.session->owner());
      if (goes_on(reason)) note_left(*entry.session);
    }
    std::erase_if(requests_, [](const auto& request) { return !request.second.name.empty(); });
  }
  for (const auto& [name, entry] : all) {
    entry.session->close(reason, text);
    if (on_ended) on_ended(*entry.session, reason);
  }
}

std::size_t Registry::size() const {
  const std::scoped_lock lock(mutex_);
  return sessions_.size();
}

void Registry::watch(const std::string& name, Timers::TimePoint when) {
  timers_->at(when, [weak = weak_from_this(), name] {
    if (const auto self = weak.lock()) self->expire(name);
  });
}

/// Closes the session if it has been idle for long enough; otherwise sets the next alarm.
void Registry::expire(const std::string& name) {
  std::shared_ptr<Session> session;
  {
    const std::scoped_lock lock(mutex_);
    const auto found = sessions_.find(name);
    if (found == sessions_.end()) return;
    session = found->second.session;
  }
  const Timers::TimePoint due = session->last_used() + limits_.idle;
  if (timers_->now() < due) return watch(name, due);
  remove(*session, EndReason::kSessionExpired, "The session was idle for too long.");
}

}  // namespace lpdeform
