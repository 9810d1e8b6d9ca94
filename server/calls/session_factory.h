#pragma once

#include <memory>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "lpdeform/v1/service.pb.h"
#include "server/calls/options.h"
#include "server/keeping/snapshot.h"
#include "server/keeping/stored_state.h"
#include "server/runtime/budget.h"
#include "server/runtime/upload.h"
#include "server/session/session.h"
#include "server/wire/decode.h"

namespace lpdeform {

/// The owner of a new session, and the route by which the owner came: see Session::route.
struct SessionMaker {
  std::string owner, route = {};
};

/// Makes sessions: from a call, or from what a store has. Takes as long as setting up the mesh does, so call
/// it on the scheduler's threads. Thread-safe.
class SessionFactory {
 public:
  SessionFactory(const ServerOptions& options, std::shared_ptr<Budget> budget,
                 std::shared_ptr<Uploads> uploads, SessionServices services);

  /// Errors: those of CreateSession.
  absl::StatusOr<std::shared_ptr<Session>> make(const SessionMaker& maker,
                                                const v1::CreateSessionRequest& request) const;

  /// Restores the session of this name completely, in the epoch of `stored`. `blobs`: those of `head`.
  /// Errors: NOT_FOUND SESSION_DAMAGED, RESOURCE_EXHAUSTED MEMORY_FULL.
  absl::StatusOr<std::shared_ptr<Session>> make_again(const std::string& name, const StoredSession& stored,
                                                      const SessionHead& head,
                                                      const StoredBlobs& blobs) const;

  /// A new session of the maker from a snapshot. On the same server it is exact to the last bit. Errors:
  /// INVALID_ARGUMENT SNAPSHOT_DAMAGED; those of CreateSession.
  absl::StatusOr<std::shared_ptr<Session>> make_from(const SessionMaker& maker,
                                                     const Snapshot& snapshot) const;

  /// A decoder for one message of a caller.
  Decoder decoder(const v1::CreateSessionRequest& request, const std::string& owner) const;

 private:
  absl::Status make_shape(const v1::CreateSessionRequest& request, Decoder decoder,
                          SessionParts& parts) const;
  absl::Status take_state(const std::string& owner, const Snapshot& snapshot, SessionParts& parts) const;
  absl::StatusOr<std::shared_ptr<Session>> finish(SessionParts parts,
                                                  const std::optional<Points>& surface = {}) const;
  int threads() const;

  const ServerOptions options_;
  const std::shared_ptr<Budget> budget_;
  const std::shared_ptr<Uploads> uploads_;
  const SessionServices services_;
};

}  // namespace lpdeform
