#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "server/runtime/timers.h"
#include "server/session/session.h"

namespace lpdeform {

/// A session as CreateSession returns it. The same request_id gives the same session again.
struct CreatedSession {
  std::shared_ptr<Session> session;
  std::string writer_token;
};

/// All sessions of a server, by name. Sessions that nobody uses for some time are closed. Thread-safe. Held
/// by a shared pointer.
class Registry : public std::enable_shared_from_this<Registry> {
 public:
  using OnCreated = std::function<void(absl::StatusOr<CreatedSession>)>;

  struct Limits {
    std::size_t most_sessions;
    Timers::Duration idle;
    /// Per owner; 0: without limit. Does not apply to the owner "", which stands for all anonymous callers.
    std::size_t most_each = 0;
  };

  Registry(std::shared_ptr<Timers> timers, Limits limits);

  /// Claims a place for a session to be made. Returns true if the caller must make it and then call
  /// finish_creation() with the same request_id; `on_created` is then told the result. Returns false if the
  /// caller has nothing to do because `on_created` is or will be called anyway: the session exists, another
  /// caller is making it, or there is an error (INVALID_ARGUMENT REQUEST_ID, REQUEST_ID_REUSED;
  /// RESOURCE_EXHAUSTED SESSIONS_FULL, CALLER_SESSIONS_FULL). `fingerprint` differs for requests that differ:
  /// the same request_id with another fingerprint is refused.
  bool begin_creation(const std::string& request_id, OnCreated on_created, std::size_t fingerprint = 0,
                      const std::string& owner = "");

  /// Enters the session, or frees its place after an error. With an empty request_id only `on_created` is
  /// told.
  void finish_creation(const std::string& request_id, absl::StatusOr<std::shared_ptr<Session>> made,
                       const OnCreated& on_created, const std::string& owner = "");

  /// Claims a place for a session that is restored from a store. RESOURCE_EXHAUSTED SESSIONS_FULL,
  /// CALLER_SESSIONS_FULL.
  absl::Status begin_restoring(const std::string& owner);

  /// Enters the restored session, which was created with this request_id and fingerprint, or frees its place
  /// after an error.
  void finish_restoring(const std::string& owner, const absl::StatusOr<std::shared_ptr<Session>>& made,
                        const std::string& request_id, std::size_t fingerprint);

  /// Whether there is a session of this name, of any owner.
  bool has(const std::string& name) const;

  /// NOT_FOUND SESSION_UNKNOWN, also if the session belongs to another owner. UNAVAILABLE SESSION_ELSEWHERE
  /// if the session has just moved to another server (kDraining), for kLeaving or until it is known to be
  /// nowhere. Counts as use.
  absl::StatusOr<std::shared_ptr<Session>> find(const std::string& name, const std::string& owner = "") const;

  /// A page of the owner's sessions, newest first: at most `most` of those after `page_token` (empty: from
  /// the beginning), with the token of the next page (empty: there is none). INVALID_ARGUMENT PAGE_TOKEN.
  struct Page {
    std::vector<std::shared_ptr<Session>> sessions;
    std::string next_page_token;
  };
  absl::StatusOr<Page> list(std::size_t most, const std::string& page_token,
                            const std::string& owner = "") const;

  /// Closes and forgets the session; false if there is none. The overload that takes a Session removes only
  /// that one, not a later session of the same name.
  bool remove(const std::string& name, EndReason reason, const std::string& text);
  bool remove(const Session& session, EndReason reason, const std::string& text);

  /// The session that left is not at another server either: find() answers SESSION_UNKNOWN from now on.
  void forget_left(const std::string& name);

  /// Ends all streams and accepts no more of them. Solve calls go on.
  void drain(const std::string& text);

  /// Closes and forgets all sessions.
  void clear(EndReason reason, const std::string& text);

  /// Called with each session that is closed, under no lock. Set it before any other call.
  std::function<void(const Session&, EndReason)> on_ended;

  /// A call that found the session here and asks for it again needs less time than this.
  static constexpr std::chrono::seconds kLeaving{10};

  Timers::Duration idle() const { return limits_.idle; }
  std::size_t size() const;

 private:
  struct Entry {
    std::shared_ptr<Session> session;
    std::string request_id;
    std::uint64_t number = 0;
  };
  struct Request {
    std::size_t fingerprint = 0;
    std::string name;  // empty while the session is being made
    std::string writer_token;
    std::vector<OnCreated> waiting;
  };
  struct Left {
    std::string owner;
    Timers::TimePoint until;
  };
  bool remove_one(const std::string& name, const Session* only, EndReason reason, const std::string& text);
  void note_left(const Session& session);
  void watch(const std::string& name, Timers::TimePoint when);
  void expire(const std::string& name);
  absl::Status check_room(const std::string& owner) const;
  std::chrono::duration<double> until_one_expires() const;
  void give_up_place(const std::string& owner);
  void enter(const std::shared_ptr<Session>& session, const std::string& request_id);

  const std::shared_ptr<Timers> timers_;
  const Limits limits_;
  mutable std::mutex mutex_;
  std::map<std::string, Entry> sessions_;
  std::map<std::uint64_t, std::string> by_age_;                      // names, by their numbers
  std::map<std::pair<std::string, std::string>, Request> requests_;  // by owner and request_id
  std::map<std::string, std::size_t> held_;  // number of sessions per owner, including those being made
  std::map<std::string, Left> left_;         // by name
  std::size_t being_made_ = 0;
  std::uint64_t numbers_ = 0;
};

}  // namespace lpdeform
