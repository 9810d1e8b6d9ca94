#include "core/problem/handles.h"

#include <algorithm>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/problem/check_handle.h"
#include "core/problem/handle_name.h"

namespace lpdeform {
namespace {

absl::Status check_region(const std::vector<std::int32_t>& region, std::int32_t vertex_count) {
  if (region.empty()) {
    return region_empty();
  }
  if (region.front() >= 0 && region.back() < vertex_count) return absl::OkStatus();
  const std::int32_t vertex = region.front() < 0 ? region.front() : region.back();
  return region_vertex_out_of_range(vertex, vertex_count);
}

absl::Status check_faces(const std::string& name, const Handle& handle, std::int32_t face_count) {
  for (const SurfacePoint& point : handle.points) {
    if (point.face >= 0 && point.face < face_count) continue;
    return handle_face_out_of_range(name, point.face, face_count);
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status HandleSet::set(std::string_view name, Handle handle) {
  if (absl::Status status = check_handle(name, handle); !status.ok()) return status;
  for (SurfacePoint& point : handle.points) point.barycentric /= point.barycentric.sum();
  handles_.insert_or_assign(std::string(name), std::move(handle));
  return absl::OkStatus();
}

absl::Status HandleSet::set_motion(std::string_view name, HandleMotion motion) {
  const auto found = handles_.find(name);
  if (found == handles_.end()) {
    return make_fault({Reason::kHandleUnknown, handle_element(name), ""},
                      absl::StrCat("there is no ", handle_element(name)));
  }
  if (absl::Status status = check_motion(name, found->second, motion); !status.ok()) return status;
  found->second.motion = std::move(motion);
  return absl::OkStatus();
}

bool HandleSet::remove(std::string_view name) {
  const auto found = handles_.find(name);
  if (found == handles_.end()) return false;
  handles_.erase(found);
  return true;
}

void HandleSet::set_region(std::vector<std::int32_t> vertices) {
  std::sort(vertices.begin(), vertices.end());
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  region_ = std::make_shared<const std::vector<std::int32_t>>(std::move(vertices));
}

bool HandleSet::has_region_of(const HandleSet& other) const {
  if (region_ == other.region_) return true;
  return region_ && other.region_ && *region_ == *other.region_;
}

bool HandleSet::operator==(const HandleSet& other) const {
  return handles_ == other.handles_ && has_region_of(other);
}

absl::Status check_handles(const HandleSet& handles, std::int32_t vertex_count, std::int32_t face_count) {
  if (handles.region() != nullptr) {
    if (absl::Status status = check_region(*handles.region(), vertex_count); !status.ok()) return status;
  }
  std::unordered_map<std::int32_t, std::string_view> owner;
  for (const auto& [name, handle] : handles.handles()) {
    if (absl::Status status = check_faces(name, handle, face_count); !status.ok()) return status;
    for (const std::int32_t vertex : handle.vertices) {
      if (vertex < 0 || vertex >= vertex_count) return handle_vertex_out_of_range(name, vertex, vertex_count);
      const auto [entry, is_new] = owner.emplace(vertex, name);
      if (is_new) continue;
      const std::string where = entry->second == name ? absl::StrCat("twice in ", handle_element(name))
                                                      : absl::StrCat("in ", handle_element(entry->second),
                                                                     " and in ", handle_element(name));
      return make_fault({Reason::kHandleVertexTwice, absl::StrCat("vertex ", vertex), "one handle a vertex"},
                        absl::StrCat("vertex ", vertex, " is ", where));
    }
  }
  return absl::OkStatus();
}

absl::Status handle_vertex_out_of_range(std::string_view handle, std::int64_t vertex, std::int64_t count) {
  return make_fault({Reason::kHandleVertexOutOfRange, absl::StrCat("vertex ", vertex),
                     absl::StrCat("0 <= vertex < ", count)},
                    absl::StrCat(handle_element(handle), " holds vertex ", vertex, "; the mesh has ", count,
                                 " vertices, 0 to ", count - 1));
}

absl::Status handle_face_out_of_range(std::string_view handle, std::int64_t face, std::int64_t count) {
  return make_fault(
      {Reason::kHandleFaceOutOfRange, absl::StrCat("face ", face), absl::StrCat("0 <= face < ", count)},
      absl::StrCat(handle_element(handle), " has a point in face ", face, "; the mesh has ", count,
                   " faces"));
}

absl::Status region_empty() {
  return make_fault({Reason::kRegionEmpty, "region", "at least 1 vertex"},
                    "the region of interest has no vertex; nothing could move");
}

absl::Status region_vertex_out_of_range(std::int64_t vertex, std::int64_t count) {
  return make_fault(
      {Reason::kRegionVertexOutOfRange, absl::StrCat("vertex ", vertex),
       absl::StrCat("0 <= vertex < ", count)},
      absl::StrCat("the region of interest has vertex ", vertex, "; the mesh has ", count, " vertices"));
}

}  // namespace lpdeform
