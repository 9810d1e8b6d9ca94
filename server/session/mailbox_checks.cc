// Mailbox: whether what an update would lead to can be solved for.

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/constraints/constraints.h"
#include "core/constraints/holds.h"
#include "core/problem/check_settings.h"
#include "core/problem/welded_inputs.h"
#include "server/session/mailbox_candidate.h"

namespace lpdeform {

absl::Status too_many_handles(std::size_t handles, std::size_t most) {
  return make_fault({Reason::kTooManyHandles, "", absl::StrCat("handles <= ", most)},
                    absl::StrCat("The session would have ", handles, " handles; it may have ", most,
                                 ". Let go of some first."));
}

absl::Status check_solver(const SolveSettings& settings, const Material& material, const HandleSet& handles) {
  if (!(settings.tolerance >= 1e-14 && settings.tolerance <= 0.1)) {
    return make_fault({Reason::kToleranceOutOfRange, "tolerance", "1e-14 <= tolerance <= 0.1"},
                      absl::StrCat("The tolerance is ", settings.tolerance, ", not within 1e-14 to 0.1."));
  }
  if (settings.max_iterations < 0) {
    return make_fault({Reason::kIterationsOutOfRange, "max_iterations", "0 <= max_iterations < 2^31"},
                      "The number of iterations does not fit into 31 bits.");
  }
  if (!(settings.time_limit_seconds > 0)) {
    return make_fault(
        {Reason::kTimeLimitOutOfRange, "time_limit_seconds", "time_limit_seconds > 0"},
        absl::StrCat("The time limit is ", settings.time_limit_seconds, " s, not more than 0."));
  }
  const double needed =
      settings.method == Method::kLocalGlobal ? 2.0 : (settings.method == Method::kConic ? 1.0 : 0.0);
  if (needed == 0.0 || (material.p.array() == needed).all()) {
    return check_method_takes(settings.method, handles);
  }
  const std::string method(method_name(settings.method));
  return make_fault({Reason::kMethodNeedsP, method, absl::StrCat("p = ", needed)},
                    absl::StrCat("Method ", method, " needs p = ", needed, " everywhere."));
}

absl::Status Mailbox::check(const Candidate& next, const Inputs& before) const {
  if (next.handles && next.handles->handles().size() > limits_.handles) {
    return too_many_handles(next.handles->handles().size(), limits_.handles);
  }
  absl::Status status;
  if (next.is_regrouped) status = check_handles(*next.handles, vertex_count(), shape_->face_count());
  if (next.has_material() && status.ok()) status = check_material(next.material, vertex_count());
  if (status.ok() && (next.has_material() || next.has_solver || next.is_regrouped)) {
    status = check_solver(next.solver, next.material, next.handles ? *next.handles : *before.given_handles);
  }
  return status;
}

/// Puts the client's vertices into the solver's.
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

/// Whether the groups can be held together: where locks and points must agree, they are put together to see. And
/// whether they go no farther than they may.
absl::Status Mailbox::check_welded(const Candidate& next) const {
  if (!next.has_handles()) return absl::OkStatus();
  const HandleSet& handles = next.solver_handles ? *next.solver_handles : *next.handles;
  absl::Status status;
  if (next.is_regrouped && has_equations(handles)) {
    status = make_constraints(*shape_, handles, FreeComponents::kStay).status();
  }
  for (const std::string& name : next.moved) {
    if (status.ok()) status = check_targets(name, handles.handles().find(name)->second);
  }
  return status;
}

/// "Vertex 17" as the client counts, "Point 2" of a handle of points.
std::string Mailbox::place_of(const Handle& handle, std::size_t k) const {
  if (!handle.points.empty()) return absl::StrCat("Point ", k);
  const std::int32_t vertex = handle.vertices[k];
  return absl::StrCat("Vertex ", weld_ ? weld_->first_copy[vertex] : vertex);
}

absl::Status Mailbox::check_targets(const std::string& name, const Handle& handle) const {
  const double farthest = kFarthestTarget * shape_->diagonal();
  const Points targets = target_positions(handle, shape_->positions(), shape_->faces());
  for (Eigen::Index k = 0; k < targets.rows(); ++k) {
    const double distance = (targets.row(k) - shape_->centre()).stableNorm();
    if (distance <= farthest) continue;
    return make_fault(
        {Reason::kHandleTargetTooFar, element_of(name), absl::StrCat("distance <= ", farthest)},
        absl::StrCat(place_of(handle, static_cast<std::size_t>(k)), " of ", element_of(name), " would be ",
                     distance, " from the mesh's centre, over ", kFarthestTarget, " of its diagonals."));
  }
  return absl::OkStatus();
}

}  // namespace lpdeform
