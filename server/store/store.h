#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace lpdeform {

/// A session as a store has it: small named parts, of which a change writes those that it is about. What is in them is
/// the business of StoredState.
struct StoredSession {
  std::string owner;
  std::string route = {};  // as StoredChange has it
  std::uint64_t epoch = 0;
  std::map<std::string, std::string> parts;
};

/// A change of one session.
struct StoredChange {
  std::string session;
  /// What the store must have; where it has another, somebody else has taken the session over, and nothing is changed.
  /// 0: the session is new.
  std::uint64_t epoch_before = 0;
  std::uint64_t epoch = 0;  // from now on; not below epoch_before
  /// Of the session's inputs, as its process counts them: what the store has to have for this change to make sense, unless
  /// it replaces all, and what it has then.
  std::uint64_t revision_before = 0, revision = 0;
  std::string owner = {};               // of a new session
  std::string route = {};               // the same: the way by which its callers come
  std::string request_id = {};          // the same; empty, or known again by Store::find_request
  std::vector<std::string> blobs = {};  // the same: keys of those that it has
  bool replaces_all = false;            // all parts that are not named here go
  bool is_anew = false;  // the store has lost it: owner, route, request and blobs are here, too
  std::map<std::string, std::optional<std::string>> parts = {};  // without a value: the part goes
  bool is_removal = false;                                       // the session goes, whoever has it
  bool is_expiry = false;  // of a removal: only where this process has it still; else kFenced
};

/// What a store that is a server of its own says of itself, for whoever runs it. Counts are since it was started.
struct StoreFigures {
  double memory_bytes = 0, memory_limit_bytes = 0;  // a limit of 0: none
  double evicted = 0;                               // what it threw away for want of memory
  double clients = 0, clients_refused = 0;
  double replicas = 0;
  double syncs_delayed = 0;  // writes to its disk that took over two seconds
  bool is_in_memory_alone = false;
  bool is_persistence_failing = false;
};

/// What is left to a store that has a disk to itself or shares one.
struct StoreRoom {
  double free_bytes = 0;   // for what is new
  double limit_bytes = 0;  // all of it, whoever has it
  bool is_full = false;    // what it last refused for want of room would be refused again
};

/// A session that a process has in its memory.
struct TouchedSession {
  std::string name;
  std::uint64_t epoch = 0;  // that the process knows
  bool is_in_use = false;
  std::uint64_t revision = 0;  // that the store called kept
  bool is_being_made = false;  // taken over, and not yet there: nobody is given it meanwhile
};

/// A session that a process has, and the epoch in which it has it.
struct HeldSession {
  std::string name;
  std::uint64_t epoch = 0;
};

/// By so much take_over() raises a session's epoch. The process before may have begun epochs that the store never heard of, as
/// writers came while it failed: these are never begun again.
inline constexpr std::uint64_t kEpochsOfALife = 1'000'000;

/// What became of a change.
enum class ChangeOutcome {
  kKept,
  kFenced,  // the store has another epoch, or no such session
  kBehind,  // not made: the store lost changes that it had called kept, and wants all
  kLost,    // not made: the store lost the session, and wants it anew, with its blobs
};

/// Sessions that touch() found to be otherwise than their process takes them to be, by name.
struct TouchResult {
  std::vector<std::string> lost;     // another process has taken them over, or they were removed
  std::vector<std::string> behind;   // the store lost changes that it had called kept
  std::vector<std::string> missing;  // the store lost them, or their blobs
  std::vector<std::string> wanted;   // another process is asked for them by callers who come their way
};

/// Where sessions are kept so that they outlive the process: their parts, and blobs (meshes), which are stored once
/// however many sessions have them. What a function has returned as done is durable, and survives the end of the process
/// at any moment. Changes are whole: a reader sees all of one or nothing of it.
///
/// Errors of all functions: UNAVAILABLE STORE_FAILING, the text saying what fails; RESOURCE_EXHAUSTED STORE_FULL, where there is no room.
/// Then nothing has changed, or, of commit(), all has: repeating it is safe. A store that is full still removes, and what it removes
/// makes room. A store whose own disk went back to an earlier moment (Redis, which may be set to keep
/// no more) is told from one that has all, as far as sessions live that know better. Functions may take long, as the disk or the
/// network does: to be called by threads that may wait. Thread-safe.
class Store {
 public:
  virtual ~Store() = default;

  /// Makes the changes, at best all at once. One outcome for each.
  virtual absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const StoredChange> changes) = 0;

  /// The session, from now on in a new epoch, kEpochsOfALife above the one that is kept, so that whoever had it is fenced off: their changes are refused.
  /// NOT_FOUND SESSION_UNKNOWN, also where it is not the owner's; SESSION_DAMAGED where it cannot be read; UNAVAILABLE
  /// SESSION_ELSEWHERE while another process has it in use, and to who comes by another way than its callers do (`route`), or says
  /// none where they do, as long as that process lives. To who comes by theirs it is given: the process that has it learns from touch() that it is wanted.
  virtual absl::StatusOr<StoredSession> take_over(const std::string& session, const std::string& owner,
                                                  const std::string& route = "") = 0;

  /// The name of the owner's session made with this request_id; empty where there is none.
  virtual absl::StatusOr<std::string> find_request(const std::string& owner,
                                                   const std::string& request_id) = 0;

  /// Names of the owner's sessions that come after `after`, ascending; at most `most`.
  virtual absl::StatusOr<std::vector<std::string>> list(const std::string& owner, const std::string& after,
                                                        std::size_t most) = 0;

  /// Keeps `bytes` under their key, blob_key(bytes), for this session. They go with the last session that has them.
  virtual absl::Status keep_blob(const std::string& session, const std::string& key,
                                 std::string_view bytes) = 0;
  /// NOT_FOUND SESSION_DAMAGED where they are not there, or are not what they were.
  virtual absl::StatusOr<std::string> blob(const std::string& key) = 0;

  /// This process has these sessions, so they are not removed as unused; where they are in use, no other process may take
  /// them over for a while.
  virtual absl::StatusOr<TouchResult> touch(std::span<const TouchedSession> sessions) = 0;
  /// How often touch() is to be called; 0: it has no haste.
  virtual std::chrono::milliseconds touch_every() const { return std::chrono::milliseconds(0); }
  /// This process lets go of the sessions, each where it had it in this epoch: another may take them over at once.
  virtual absl::Status let_go(const std::vector<HeldSession>& sessions) = 0;
  /// Removes the sessions that nobody has touched for so long, the time that no server ran aside where the store knows it.
  /// How many went.
  virtual absl::StatusOr<std::size_t> remove_unused(std::int64_t idle_ms) = 0;

  /// Nothing where it is no server of its own. On the thread that calls touch().
  virtual absl::StatusOr<std::optional<StoreFigures>> figures() { return std::nullopt; }

  /// Nothing where the store cannot tell. On the thread that calls touch().
  virtual std::optional<StoreRoom> room() { return std::nullopt; }

  /// The process is about to end: after this moment nobody is waited for, and whatever needs an answer fails. Where waits have
  /// no end of their own (a disk), this changes nothing.
  virtual void end_by(std::chrono::steady_clock::time_point) {}
};

/// SHA-256 of the bytes, as 64 hexadecimal digits.
std::string blob_key(std::string_view bytes);

/// UNAVAILABLE STORE_FAILING. `where`, here and below: a file or an address, for operators alone (see text_for_operators).
absl::Status store_failing(std::string_view why, std::string_view where = "");
/// RESOURCE_EXHAUSTED STORE_FULL. `limit`: the bound, where it is one that somebody set.
absl::Status store_full(std::string_view why, std::string_view limit = "", std::string_view where = "");
/// What callers are told, and where that was: for the log and for whoever starts a server.
std::string text_for_operators(const absl::Status& status);
bool is_full(const absl::Status& status);
/// The same for whoever starts a server and has not room enough for it: how much it takes, and where, in a folder of this name.
absl::Status store_full_at_start(const absl::Status& full, const std::string& folder);
/// The same, where there is no answer: whatever it is asked next has none either.
absl::Status store_away(std::string_view why, std::string_view where = "");
bool is_away(const absl::Status& status);
/// NOT_FOUND SESSION_DAMAGED: what there is of it cannot be used.
/// `where`: a file or a part, for the log alone.
absl::Status session_damaged(std::string_view why, std::string_view where = "");
/// The same, where reading it again as a caller's input gave this error: its text may quote coordinates.
absl::Status session_damaged(const absl::Status& why);
/// What of it is damaged, for the log; empty of other errors.
std::string damage_of(const absl::Status& status);
/// What a call's header has to say that is to come this way.
std::string route_header(const std::string& route);
/// UNAVAILABLE SESSION_ELSEWHERE, its limit route_header(). `route`: of the session; may be empty.
absl::Status session_elsewhere(const std::string& route = "");

}  // namespace lpdeform
