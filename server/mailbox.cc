#include "server/mailbox.h"

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/solve/constraints.h"

namespace lpdeform {
namespace {

/// Names that ages are kept for: all handles, and as many that were let go of.
constexpr std::size_t kMostAges = 2 * Mailbox::kMostHandles;

std::string element_of(std::string_view name) {
  return absl::StrCat("handle \"", absl::string_view(name.data(), std::min<std::size_t>(name.size(), 128)),
                      "\"");
}

}  // namespace

absl::Status check_solver(const SolveSettings& settings, const Material& material) {
  if (!(settings.tolerance >= 1e-14 && settings.tolerance <= 0.1)) {
    return invalid_input({"TOLERANCE_OUT_OF_RANGE", "tolerance", "1e-14 <= tolerance <= 0.1"},
                         absl::StrCat("The tolerance is ", settings.tolerance, ", not within 1e-14 to 0.1."));
  }
  if (settings.max_iterations < 0) {
    return invalid_input({"ITERATIONS_OUT_OF_RANGE", "max_iterations", "0 <= max_iterations < 2^31"},
                         "The number of iterations does not fit into 31 bits.");
  }
  if (!(settings.time_limit_seconds > 0)) {
    return invalid_input(
        {"TIME_LIMIT_OUT_OF_RANGE", "time_limit_seconds", "time_limit_seconds > 0"},
        absl::StrCat("The time limit is ", settings.time_limit_seconds, " s, not more than 0."));
  }
  const double needed =
      settings.method == Method::kLocalGlobal ? 2.0 : (settings.method == Method::kConic ? 1.0 : 0.0);
  if (needed == 0.0 || (material.p.array() == needed).all()) return absl::OkStatus();
  const std::string method(method_name(settings.method));
  return invalid_input({"METHOD_NEEDS_P", method, absl::StrCat("p = ", needed)},
                       absl::StrCat("Method ", method, " needs p = ", needed, " everywhere."));
}

/// What an update would lead to.
struct Mailbox::Candidate {
  std::shared_ptr<HandleSet> handles;  // our copy; empty where the update changes no handle
  Material material;
  SolveSettings solver;
  Ages ages;
  bool is_beginning = false;
  bool is_regrouped = false;  // vertices of handles changed
  bool is_material_changed = false;
  bool is_solver_changed = false;
  std::vector<std::string> moved;
  std::uint32_t stale_parts = 0;

  /// Whether a value of `seq` is to replace one of age `age`, which it then has.
  bool replaces(std::uint64_t& age, std::uint64_t seq) {
    if (seq < age) ++stale_parts;
    if (seq <= age && !is_beginning) return false;
    age = seq;
    return true;
  }

  bool replaces_handle(const std::string& name, std::uint64_t seq) {
    const auto known = ages.handles.find(name);
    if (known != ages.handles.end()) return replaces(known->second, seq);
    if (seq <= ages.forgotten && !is_beginning) {
      ++stale_parts;
      return false;
    }
    ages.handles.emplace(name, seq);
    return true;
  }

  bool changes_anything() const { return handles != nullptr || is_material_changed || is_solver_changed; }

  /// Gives up the ages of handles long gone, oldest first.
  void forget_oldest() {
    while (ages.handles.size() > kMostAges) {
      auto oldest = ages.handles.end();
      for (auto entry = ages.handles.begin(); entry != ages.handles.end(); ++entry) {
        const bool is_gone = handles->handles().find(entry->first) == handles->handles().end();
        if (is_gone && (oldest == ages.handles.end() || entry->second < oldest->second)) oldest = entry;
      }
      ages.forgotten = std::max(ages.forgotten, oldest->second);
      ages.handles.erase(oldest);
    }
  }
};

Mailbox::Mailbox(std::shared_ptr<const RestShape> shape) : shape_(std::move(shape)) {
  inputs_.handles = std::make_shared<const HandleSet>();
  inputs_.material = std::make_shared<const Material>();
}

Inputs Mailbox::newest() const {
  const std::scoped_lock lock(mutex_);
  return inputs_;
}

absl::StatusOr<UpdateResult> Mailbox::take(const Update& update) {
  if (update.input_seq == 0) {
    return invalid_input({"INPUT_SEQ_ZERO", "input_seq", "input_seq >= 1"},
                         "The update's input_seq is 0; numbers rise from 1.");
  }
  return merge(update, false);
}

absl::Status Mailbox::begin_with(const Update& update) {
  return merge(update, true).status();
}

absl::StatusOr<UpdateResult> Mailbox::merge(const Update& update, bool is_beginning) {
  const std::scoped_lock merging(merging_);
  const Inputs before = newest();
  Candidate next;
  next.material = *before.material;
  next.solver = before.solver;
  next.ages = ages_;
  next.is_beginning = is_beginning;
  if (!update.handles.empty()) next.handles = std::make_shared<HandleSet>(*before.handles);
  if (absl::Status status = change_handles(update, next); !status.ok()) return status;
  if (next.moved.empty() && !next.is_regrouped) next.handles = nullptr;
  change_settings(update, next);
  if (absl::Status status = check(next); !status.ok()) return status;

  ages_ = std::move(next.ages);
  const std::scoped_lock lock(mutex_);
  const bool is_newer = update.input_seq > inputs_.input_seq;
  if (next.changes_anything() || is_newer) ++inputs_.version;
  if (is_newer) {
    inputs_.input_seq = update.input_seq;
    ++inputs_.taken;
  }
  if (next.handles) inputs_.handles = std::move(next.handles);
  if (next.is_material_changed) inputs_.material = std::make_shared<const Material>(std::move(next.material));
  inputs_.solver = next.solver;
  return UpdateResult{update.input_seq, next.stale_parts};
}

absl::Status Mailbox::change_handles(const Update& update, Candidate& next) const {
  std::set<std::string_view> names;
  for (const HandleChange& change : update.handles) {
    if (!names.insert(change.name).second) {
      return invalid_input({"HANDLE_CHANGED_TWICE", element_of(change.name), "one change a handle"},
                           absl::StrCat("The update changes ", element_of(change.name), " twice."));
    }
    if (!next.replaces_handle(change.name, update.input_seq)) continue;
    absl::Status status;
    if (const auto* const handle = std::get_if<Handle>(&change.change)) {
      status = next.handles->set(change.name, *handle);
      next.is_regrouped = true;
      next.moved.push_back(change.name);
    } else if (const auto* const motion = std::get_if<HandleMotion>(&change.change)) {
      status = next.handles->set_motion(change.name, *motion);
      next.moved.push_back(change.name);
    } else {
      next.is_regrouped = next.handles->remove(change.name) || next.is_regrouped;
    }
    if (!status.ok()) return status;
  }
  if (!next.handles) return absl::OkStatus();
  if (next.handles->handles().size() > kMostHandles) {
    return invalid_input({"TOO_MANY_HANDLES", "", absl::StrCat("handles <= ", kMostHandles)},
                         absl::StrCat("The session would have ", next.handles->handles().size(),
                                      " handles; it may have ", kMostHandles, "."));
  }
  next.forget_oldest();
  return absl::OkStatus();
}

void Mailbox::change_settings(const Update& update, Candidate& next) const {
  const SettingsChange& settings = update.settings;
  const std::uint64_t seq = update.input_seq;
  if (settings.p && next.replaces(next.ages.p, seq)) {
    next.material.p = *settings.p;
    next.is_material_changed = true;
  }
  if (settings.stiffness && next.replaces(next.ages.stiffness, seq)) {
    next.material.stiffness = *settings.stiffness;
    next.is_material_changed = true;
  }
  if (settings.length_unit && next.replaces(next.ages.length_unit, seq)) {
    next.material.length_unit = *settings.length_unit;
    next.is_material_changed = true;
  }
  if (settings.solver && next.replaces(next.ages.solver, seq)) {
    next.solver = *settings.solver;
    next.is_solver_changed = true;
  }
}

absl::Status Mailbox::check(const Candidate& next) const {
  absl::Status status;
  if (next.is_regrouped) status.Update(check_handles(*next.handles, shape_->vertex_count()));
  for (const std::string& name : next.moved) {
    if (status.ok()) status = check_targets(name, next.handles->handles().find(name)->second);
  }
  if (next.is_material_changed && status.ok()) status = check_material(next.material, shape_->vertex_count());
  if (status.ok() && (next.is_material_changed || next.is_solver_changed)) {
    status = check_solver(next.solver, next.material);
  }
  return status;
}

absl::Status Mailbox::check_targets(const std::string& name, const Handle& handle) const {
  const double farthest = kFarthestTarget * shape_->diagonal();
  const Points targets = target_positions(handle, shape_->positions());
  for (Eigen::Index k = 0; k < targets.rows(); ++k) {
    const double distance = (targets.row(k) - shape_->centre()).stableNorm();
    if (distance <= farthest) continue;
    return invalid_input(
        {"HANDLE_TARGET_TOO_FAR", element_of(name), absl::StrCat("distance <= ", farthest)},
        absl::StrCat("Vertex ", handle.vertices[static_cast<std::size_t>(k)], " of ", element_of(name),
                     " would be ", distance, " from the mesh's centre, over ", kFarthestTarget,
                     " of its diagonals."));
  }
  return absl::OkStatus();
}

}  // namespace lpdeform
