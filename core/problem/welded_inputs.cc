#include "core/problem/welded_inputs.h"

#include <string>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

std::string in_quotes(std::string_view name) {
  return absl::StrCat("handle \"", std::string(name), "\"");
}

absl::Status copies_differ(std::string_view what, std::int32_t first, std::int32_t second) {
  return make_fault(
      {Reason::kCopiesDiffer, absl::StrCat("vertex ", second), "the same for all copies"},
      absl::StrCat("The ", std::string(what), " of vertex ", second, " are not those of vertex ", first,
                   ", though both are copies of one vertex."));
}

/// Values that compare equal are the same; there is no NaN here.
template <typename One, typename Other>
bool is_same(const One& a, const Other& b) {
  return (a.array() == b.array()).all();
}

/// Whether positions are equal up to rounding. So a mesh whose copies are 1e-16 apart can be moved without changes.
template <typename One, typename Other>
bool is_same_place(const One& a, const Other& b, const Weld& weld) {
  return is_same(a, b) || (a - b).norm() <= weld.same_place;
}

/// Converts rows of split vertices to rows of welded vertices: takes the row of the first copy, and requires
/// `same(copy, first copy)` for all others.
template <typename Matrix, typename Same>
absl::StatusOr<Matrix> merged(const Matrix& split, const Weld& weld, std::string_view what,
                              const Same& same) {
  Matrix result(weld.welded_count(), split.cols());
  for (std::int32_t v = 0; v < weld.split_count(); ++v) {
    const std::int32_t vertex = weld.to_welded[v], first = weld.first_copy[vertex];
    if (v == first) {
      result.row(vertex) = split.row(v);
    } else if (!same(split.row(v), result.row(vertex))) {
      return copies_differ(what, first, v);
    }
  }
  return result;
}

/// The handle that holds a welded vertex, the copy that it names, and the index of that copy among the handle's
/// vertices.
struct Holder {
  std::string_view handle;
  std::int32_t copy;
  std::size_t place;
};

absl::Status held_twice(const Holder& holder, std::string_view other, std::int32_t copy) {
  return make_fault({Reason::kHandleVertexTwice, absl::StrCat("vertex ", copy), "one handle a vertex"},
                    absl::StrCat("vertex ", holder.copy, " is in ", in_quotes(holder.handle), " and vertex ",
                                 copy, " in ", in_quotes(other), ", and both are copies of one vertex"));
}

absl::StatusOr<Handle> merged_handle(std::string_view name, const Handle& split, const Weld& weld,
                                     std::unordered_map<std::int32_t, Holder>& holders) {
  if (!split.points.empty()) return split;  // points refer to faces, which do not change
  const auto* const targets = std::get_if<TargetPositions>(&split.motion);
  Handle handle = split;
  handle.vertices.clear();
  std::vector<Eigen::Index> rows;
  for (std::size_t k = 0; k < split.vertices.size(); ++k) {
    const std::int32_t copy = split.vertices[k], vertex = weld.to_welded[copy];
    const auto [entry, is_new] = holders.emplace(vertex, Holder{name, copy, k});
    const Holder& holder = entry->second;
    if (is_new) {
      handle.vertices.push_back(vertex);
      rows.push_back(static_cast<Eigen::Index>(k));
      continue;
    }
    if (holder.handle != name) return held_twice(holder, name, copy);
    if (targets != nullptr &&
        !is_same_place(targets->positions.row(static_cast<Eigen::Index>(k)),
                       targets->positions.row(static_cast<Eigen::Index>(holder.place)), weld)) {
      return copies_differ(absl::StrCat("target positions in ", in_quotes(name)), holder.copy, copy);
    }
  }
  if (targets != nullptr) handle.motion = TargetPositions{rows_of(targets->positions, rows)};
  return handle;
}

absl::StatusOr<Field> merged_field(const Field& split, const Weld& weld, std::string_view what) {
  if (split.size() == 1) return split;
  return merged(split, weld, what, [](const auto& a, const auto& b) { return is_same(a, b); });
}

}  // namespace

absl::StatusOr<HandleSet> welded(const HandleSet& split, const Weld& weld) {
  HandleSet result;
  std::unordered_map<std::int32_t, Holder> holders;
  for (const auto& [name, handle] : split.handles()) {
    auto one = merged_handle(name, handle, weld, holders);
    if (!one.ok()) return one.status();
    if (absl::Status status = result.set(name, *std::move(one)); !status.ok()) return status;
  }
  if (split.region() == nullptr) return result;
  std::vector<std::int32_t> region;
  for (const std::int32_t copy : *split.region()) region.push_back(weld.to_welded[copy]);
  result.set_region(std::move(region));
  return result;
}

absl::StatusOr<Material> welded(const Material& split, const Weld& weld) {
  Material result = split;
  auto p = merged_field(split.p, weld, "values of p");
  if (!p.ok()) return p.status();
  auto stiffness = merged_field(split.stiffness, weld, "values of stiffness");
  if (!stiffness.ok()) return stiffness.status();
  result.p = *std::move(p);
  result.stiffness = *std::move(stiffness);
  return result;
}

absl::StatusOr<Points> welded(const Points& split, const Weld& weld, std::string_view what) {
  return merged(split, weld, what, [&](const auto& a, const auto& b) { return is_same_place(a, b, weld); });
}

}  // namespace lpdeform
