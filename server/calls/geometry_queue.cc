#include "server/calls/geometry_queue.h"

#include <utility>

#include "server/runtime/refusals.h"

namespace lpdeform {

GeometryQueue::Part GeometryQueue::Waiting::missing(const ShapeFeatures& features) const {
  if (needs_joint && !features.knows_joint()) return Part::kJoint;
  return needs_bending && !features.knows_bending() ? Part::kBending : Part::kNone;
}

void GeometryQueue::when_found(const std::shared_ptr<const Session>& session, const v1::Update& update,
                               Then then) {
  const v1::SettingsUpdate& settings = update.settings();
  Waiting waiting{settings.p().has_automatic() || settings.stiffness().has_automatic(), update.has_resize(),
                  std::move(then)};
  if (waiting.missing(session->features()) == Part::kNone) return waiting.then(absl::OkStatus());
  auto memory = budget_->reserve(update.SpaceUsedLong(), session->owner());
  if (!memory.ok()) return waiting.then(memory.status());
  waiting.memory = *std::move(memory);
  wait(session, std::move(waiting));
}

void GeometryQueue::wait(const std::shared_ptr<const Session>& session, Waiting waiting) {
  const Part part = waiting.missing(session->features());
  {
    const std::scoped_lock lock(mutex_);
    const auto [found, is_new] = waiting_.try_emplace(session);
    if (found->second.size() < kMostWaiting) {
      found->second.push_back(std::move(waiting));
      if (is_new) scheduler_.run_once([this, session, part] { find(session, part); });
      return;
    }
  }
  waiting.then(server_busy(pool_.expected_wait()));
}

/// Called on a thread of the scheduler. It finds one part at a time, so that a session takes one thread.
/// Callers that need the other part wait again.
void GeometryQueue::find(const std::shared_ptr<const Session>& session, Part part) {
  const ShapeFeatures& features = session->features();
  part == Part::kJoint ? static_cast<void>(features.joint()) : static_cast<void>(features.bending());
  std::vector<Waiting> waiting;
  {
    const std::scoped_lock lock(mutex_);
    waiting = std::move(waiting_.extract(session).mapped());
  }
  for (Waiting& one : waiting) {
    if (one.missing(features) != Part::kNone) {
      wait(session, std::move(one));
    } else if (!pool_.try_post([then = one.then] { then(absl::OkStatus()); })) {
      one.then(server_busy(pool_.expected_wait()));
    }
  }
}

}  // namespace lpdeform
