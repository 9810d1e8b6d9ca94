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

/// A session as a store has it: small named parts. A change writes only the parts that it concerns.
/// StoredState gives the parts their meaning.
struct StoredSession {
  std::string owner;
  std::string route = {};  // see StoredChange::route
  std::uint64_t epoch = 0;
  std::map<std::string, std::string> parts;
};

/// A change of one session.
struct StoredChange {
  std::string session;
  /// The epoch that the store must have (fencing). If it has another one, another process has taken the
  /// session over, and nothing is changed. 0: the session is new.
  std::uint64_t epoch_before = 0;
  std::uint64_t epoch = 0;  // the epoch from now on; at least epoch_before
  /// Revisions of the session's inputs, as its process counts them. The store must have `revision_before`,
  /// unless the change replaces all parts. After the change it has `revision`.
  std::uint64_t revision_before = 0, revision = 0;
  std::string owner = {};               // only for a new session
  std::string route = {};               // only for a new session: the route of its callers
  std::string request_id = {};          // only for a new session: for Store::find_request; may be empty
  std::vector<std::string> blobs = {};  // only for a new session: keys of its blobs
  bool replaces_all = false;            // removes all parts that are not named here
  bool is_recreated = false;  // the store has lost the session: owner, route, request and blobs are set, too
  std::map<std::string, std::optional<std::string>> parts = {};  // a part without a value is removed
  bool is_removal = false;                                       // removes the session, whoever holds it
  bool is_expiry = false;  // with is_removal: only if this process still holds it; else kFenced
};

/// What a store that is a separate server reports of itself, for operators. Counts are since that server was
/// started.
struct StoreFigures {
  double memory_bytes = 0, memory_limit_bytes = 0;  // a limit of 0: none
  double evicted = 0;                               // keys that it evicted for lack of memory
  double clients = 0, clients_refused = 0;
  double replicas = 0;
  double syncs_delayed = 0;  // writes to its disk that took over two seconds
  bool is_in_memory_alone = false;
  bool is_persistence_failing = false;
};

/// The room that is left to a store on a disk.
struct StoreRoom {
  double free_bytes = 0;   // for new data
  double limit_bytes = 0;  // free or used
  bool is_full = false;    // the store would refuse again what it last refused as full
};

/// A session that a process has in its memory.
struct TouchedSession {
  std::string name;
  std::uint64_t epoch = 0;  // as the process knows it
  bool is_in_use = false;
  std::uint64_t revision = 0;  // the newest that the store confirmed
  bool is_being_made = false;  // taken over but not complete yet: no other process may have it meanwhile
};

/// A session that a process holds, and the epoch in which it holds it.
struct HeldSession {
  std::string name;
  std::uint64_t epoch = 0;
};

/// By how much take_over() raises a session's epoch. The previous process may have begun epochs that the
/// store never heard of, because new writers came while the store failed. Those epochs are never used again.
inline constexpr std::uint64_t kEpochsOfALife = 1'000'000;

/// The result of a change.
enum class ChangeOutcome {
  kKept,
  kFenced,  // the store has another epoch, or no such session
  kBehind,  // not made: the store lost changes that it had confirmed, and needs all parts
  kLost,    // not made: the store lost the session, and needs all of it with its blobs
};

/// Names of sessions for which touch() found a difference between store and process.
struct TouchResult {
  std::vector<std::string> lost;     // another process has taken them over, or they were removed
  std::vector<std::string> behind;   // the store lost changes that it had confirmed
  std::vector<std::string> missing;  // the store lost them, or their blobs
  std::vector<std::string> wanted;   // callers with the session's route ask another process for them
};

/// Where sessions are kept so that they outlive the process: their parts, and blobs (meshes), which are
/// stored once however many sessions use them. When a function returns OK, its result is durable and survives
/// the end of the process at any moment. Changes are atomic: a reader sees all of a change or nothing.
///
/// Errors of all functions: UNAVAILABLE STORE_FAILING, whose text says what fails; RESOURCE_EXHAUSTED
/// STORE_FULL if there is no room. After an error nothing has changed; after a failed commit() possibly
/// everything has, and repeating it is safe. A full store still removes, and that frees room. If the disk of
/// the store itself went back to an earlier state (Redis may be configured to lose recent data), this is
/// detected for sessions that a process still has. Functions may take as long as the disk or the network
/// does, so call them from threads that may wait. Thread-safe.
class Store {
 public:
  virtual ~Store() = default;

  /// Makes the changes, all at once if possible. Returns one outcome per change.
  virtual absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const StoredChange> changes) = 0;

  /// Takes the session over in a new epoch, kEpochsOfALife above the stored one. The previous holder is
  /// fenced: its changes are refused. Errors: NOT_FOUND SESSION_UNKNOWN, also if the session belongs to
  /// another owner; SESSION_DAMAGED if it cannot be read; UNAVAILABLE SESSION_ELSEWHERE while another process
  /// has it in use. A caller with another `route` than the session's, or with none although the session has
  /// one, gets SESSION_ELSEWHERE as long as the holder's process lives. A caller with the right route gets
  /// the session: touch() tells the process that has it that it is wanted.
  virtual absl::StatusOr<StoredSession> take_over(const std::string& session, const std::string& owner,
                                                  const std::string& route = "") = 0;

  /// The name of the owner's session that was made with this request_id; empty if there is none.
  virtual absl::StatusOr<std::string> find_request(const std::string& owner,
                                                   const std::string& request_id) = 0;

  /// Names of the owner's sessions after `after`, ascending; at most `most`.
  virtual absl::StatusOr<std::vector<std::string>> list(const std::string& owner, const std::string& after,
                                                        std::size_t most) = 0;

  /// Stores `bytes` under their key, blob_key(bytes), for this session. The blob is removed with the last
  /// session that uses it.
  virtual absl::Status keep_blob(const std::string& session, const std::string& key,
                                 std::string_view bytes) = 0;
  /// NOT_FOUND SESSION_DAMAGED if the blob is missing or has changed.
  virtual absl::StatusOr<std::string> blob(const std::string& key) = 0;

  /// This process has these sessions: they are not removed as unused. For those in use it also renews the
  /// lease, so that no other process may take them over for some time.
  virtual absl::StatusOr<TouchResult> touch(std::span<const TouchedSession> sessions) = 0;
  /// How often touch() must be called; 0: at any interval.
  virtual std::chrono::milliseconds touch_every() const { return std::chrono::milliseconds(0); }
  /// This process releases the sessions that it holds in the given epochs. Another process may take them over
  /// at once.
  virtual absl::Status release(const std::vector<HeldSession>& sessions) = 0;
  /// Removes the sessions that nobody has touched for this long. Time in which no server ran does not count
  /// if the store knows it. Returns how many were removed.
  virtual absl::StatusOr<std::size_t> remove_unused(std::int64_t idle_ms) = 0;

  /// nullopt if the store is not a separate server. Called on the thread that calls touch().
  virtual absl::StatusOr<std::optional<StoreFigures>> figures() { return std::nullopt; }

  /// nullopt if the store cannot tell. Called on the thread that calls touch().
  virtual std::optional<StoreRoom> room() { return std::nullopt; }

  /// The process is about to end: after this moment the store waits for nothing, and every function that
  /// needs an answer fails. This has no effect on waits that cannot be interrupted (a disk).
  virtual void end_by(std::chrono::steady_clock::time_point) {}
};

/// SHA-256 of the bytes, as 64 hexadecimal digits.
std::string blob_key(std::string_view bytes);

/// UNAVAILABLE STORE_FAILING. `where`, here and below: a file or an address, which only operators are told
/// (see text_for_operators).
absl::Status store_failing(std::string_view why, std::string_view where = "");
/// RESOURCE_EXHAUSTED STORE_FULL. `limit`: the limit that was reached, if an operator set one.
absl::Status store_full(std::string_view why, std::string_view limit = "", std::string_view where = "");
/// The text of the error with its place (`where`), for the log and for whoever starts a server.
std::string text_for_operators(const absl::Status& status);
bool is_full(const absl::Status& status);
/// The same for an operator who starts a server without enough room: how much is needed, and where. `folder`:
/// the store's folder.
absl::Status store_full_at_start(const absl::Status& full, const std::string& folder);
/// UNAVAILABLE STORE_FAILING because nothing answers; the next request would get no answer either.
absl::Status store_away(std::string_view why, std::string_view where = "");
bool is_away(const absl::Status& status);
/// NOT_FOUND SESSION_DAMAGED: the stored data cannot be used. `where`: a file or a part, for the log alone.
absl::Status session_damaged(std::string_view why, std::string_view where = "");
/// The same, for stored data that was refused with this error when it was read as input. The error's text may
/// quote coordinates, so it is left out.
absl::Status session_damaged(const absl::Status& why);
/// What is damaged, for the log; empty for other errors.
std::string damage_of(const absl::Status& status);
/// The header that a call must have to reach this route.
std::string route_header(const std::string& route);
/// UNAVAILABLE SESSION_ELSEWHERE, with route_header() as its limit. `route`: of the session; may be empty.
absl::Status held_elsewhere(const std::string& route);

}  // namespace lpdeform
