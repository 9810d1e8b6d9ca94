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

/// Finds what updates leave to a mesh's geometry (AutomaticField, Resize) before they are decoded, because it takes seconds of
/// a large mesh: on the scheduler's threads, once a session. Whoever asks meanwhile waits without a thread. Thread-safe.
class GeometryQueue {
 public:
  using Then = std::function<void(absl::Status)>;

  GeometryQueue(Scheduler& scheduler, TaskPool& pool, std::shared_ptr<Budget> budget)
      : scheduler_(scheduler), pool_(pool), budget_(std::move(budget)) {}

  /// Calls `then` with OK once decoding `update` for this session does not wait for its geometry: at once where it asks for
  /// nothing that is not known, else on a thread of the pool. What waits is memory of the session's owner. RESOURCE_EXHAUSTED
  /// SERVER_BUSY where kMostWaiting wait for the session, or too many for the pool; MEMORY_FULL, CALLER_MEMORY_FULL.
  void when_found(const std::shared_ptr<const Session>& session, const v1::Update& update, Then then);

  /// Calls that wait for one session's geometry; each holds its message.
  static constexpr std::size_t kMostWaiting = 64;

 private:
  enum class Part { kNone, kJoint, kBending };
  struct Waiting {
    bool needs_joint, needs_bending;
    Then then;
    Reservation memory = {};  // of its message
    Part missing(const ShapeFeatures& features) const;
  };
  void wait(const std::shared_ptr<const Session>& session, Waiting waiting);
  void find(const std::shared_ptr<const Session>& session, Part part);

  Scheduler& scheduler_;
  TaskPool& pool_;
  const std::shared_ptr<Budget> budget_;
  std::mutex mutex_;
  std::map<std::shared_ptr<const Session>, std::vector<Waiting>>
      waiting_;  // of each session that is looked at
};

}  // namespace lpdeform
