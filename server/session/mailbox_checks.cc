// Mailbox: whether the state that an update would lead to can be solved for.

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/constraints/check_positions.h"
#include "core/constraints/constraints.h"
#include "core/problem/check_settings.h"
#include "core/problem/welded_inputs.h"
#include "server/session/mailbox_candidate.h"

namespace lpdeform {

absl::Status too_many_handles(std::size_t handles, std::size_t most) {
  return make_fault({Reason::kTooManyHandles, "", absl::StrCat("handles <= ", most)},
                    absl::StrCat("The session would have ", handles, " handles; it may have ", most,
                                 ". Remove some first."));
}

absl::Status Mailbox::check(const Candidate& next, const Inputs& before) const {
  if (next.handles && next.handles->handles().size() > limits_.handles) {
    return too_many_handles(next.handles->handles().size(), limits_.handles);
  }
  absl::Status status;
  if (next.is_regrouped) status = check_handles(*next.handles, vertex_count(), shape_->face_count());
  if (next.has_material() && status.ok()) status = check_material(next.material, vertex_count());
  if (status.ok() && (next.has_material() || next.has_solver || next.is_regrouped)) {
    status = check_settings(next.solver, next.material);
    const HandleSet& handles = next.handles ? *next.handles : *before.given_handles;
    if (status.ok()) status = check_method_takes(next.solver.method, handles);
  }
  return status;
}

/// Converts the client's vertices to the solver's.
absl::Status Mailbox::weld(Candidate& next) const {
  if (!weld_) return absl::OkStatus();
  if (next.has_handles()) {
    auto handles = welded(*next.handles, *weld_);
    if (!handles.ok()) return handles.status();
    next.solver_handles = std::make_shared<const HandleSet>(*std::move(handles));
  }
  if (next.has_material()) {
    auto material = welded(next.material, *weld_);
    if (!material.ok()) return material.status();
    next.solver_material = std::make_shared<const Material>(*std::move(material));
  }
  return absl::OkStatus();
}

/// Whether handles stay within their range, and whether locks and points are compatible.
absl::Status Mailbox::check_welded(const Candidate& next) const {
  if (!next.has_handles()) return absl::OkStatus();
  const HandleSet& handles = next.solver_handles ? *next.solver_handles : *next.handles;
  absl::Status status;
  for (const std::string& name : next.moved) {
    if (!status.ok()) break;
    const Handle& handle = handles.handles().find(name)->second;
    const Points targets = target_positions(handle, shape_->positions(), shape_->faces());
    status = check_targets(*shape_, name, handle, targets, weld_ ? &weld_->first_copy : nullptr);
  }
  if (status.ok() && next.is_regrouped) status = check_equations(*shape_, handles);
  return status;
}

}  // namespace lpdeform
