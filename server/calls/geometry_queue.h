#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "lpdeform/v1/service.pb.h"
#include "server/runtime/budget.h"
#include "server/runtime/scheduler.h"
#include "server/runtime/task_pool.h"
#include "server/session/session.h"

namespace lpdeform {

/// Some updates leave values for the server to find in a mesh's geometry (AutomaticField, Resize). This takes
/// seconds for a large mesh. The queue does it before such updates are decoded, on the scheduler's threads
/// and once per session. Callers that wait for it hold no thread. Thread-safe.
class GeometryQueue {
 public:
  using Then = std::function<void(absl::Status)>;

  GeometryQueue(Scheduler& scheduler, TaskPool& pool, std::shared_ptr<Budget> budget)
      : scheduler_(scheduler), pool_(pool), budget_(std::move(budget)) {}

  /// Calls `then` with OK once `update` can be decoded without waiting for the session's geometry: at once if
  /// it needs nothing new, otherwise on a thread of the pool. While an update waits, its memory is charged to
  /// the session's owner. Errors: RESOURCE_EXHAUSTED SERVER_BUSY if kMostWaiting calls wait for the session,
  /// or too many for the pool; MEMORY_FULL, CALLER_MEMORY_FULL.
  void when_found(const std::shared_ptr<const Session>& session, const v1::Update& update, Then then);

  /// How many calls may wait for one session's geometry; each holds its message.
  static constexpr std::size_t kMostWaiting = 64;

 private:
  enum class Part { kNone, kJoint, kBending };
  struct Waiting {
    bool needs_joint, needs_bending;
    Then then;
    Reservation memory = {};  // for its message
    Part missing(const ShapeFeatures& features) const;
  };
  void wait(const std::shared_ptr<const Session>& session, Waiting waiting);
  void find(const std::shared_ptr<const Session>& session, Part part);

  Scheduler& scheduler_;
  TaskPool& pool_;
  const std::shared_ptr<Budget> budget_;
  std::mutex mutex_;
  /// For each session whose geometry is being found.
  std::map<std::shared_ptr<const Session>, std::vector<Waiting>> waiting_;
};

}  // namespace lpdeform
