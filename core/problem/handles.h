#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "core/problem/handle.h"

namespace lpdeform {

/// All handles of a session, by name, and the region of interest. A plain value: change a copy, then pass it to
/// Deformer::set_handles.
class HandleSet {
 public:
  /// Adds a handle or replaces the handle of that name. Errors: as check_handle. check_handles checks later, when the
  /// whole set is known, that vertices exist and belong to only one handle.
  absl::Status set(std::string_view name, Handle handle);

  /// Moves a handle. NOT_FOUND (HANDLE_UNKNOWN); INVALID_ARGUMENT: as check_motion.
  absl::Status set_motion(std::string_view name, HandleMotion motion);

  /// False if there was none.
  bool remove(std::string_view name);

  const std::map<std::string, Handle, std::less<>>& handles() const { return handles_; }

  /// Only these vertices may move. Vertices outside the region are held at their positions at the time when the region
  /// takes effect, even if handles hold them elsewhere. The border needs no special treatment: the cells of the
  /// vertices next to the region count in the energy.
  void set_region(std::vector<std::int32_t> vertices);
  /// Everything may move again.
  void clear_region() { region_ = nullptr; }
  /// Ascending, each once; null if there is no region.
  const std::vector<std::int32_t>* region() const { return region_.get(); }
  bool has_region_of(const HandleSet& other) const;

  bool operator==(const HandleSet& other) const;

 private:
  std::map<std::string, Handle, std::less<>> handles_;
  std::shared_ptr<const std::vector<std::int32_t>> region_;
};

/// INVALID_ARGUMENT: HANDLE_VERTEX_OUT_OF_RANGE, HANDLE_VERTEX_TWICE (in one handle or in two; names both),
/// HANDLE_FACE_OUT_OF_RANGE, REGION_EMPTY, REGION_VERTEX_OUT_OF_RANGE.
absl::Status check_handles(const HandleSet& handles, std::int32_t vertex_count, std::int32_t face_count = 0);

/// The same errors, for callers whose numbers may not fit a std::int32_t. `count`: the number of the mesh's vertices or
/// faces.
absl::Status handle_vertex_out_of_range(std::string_view handle, std::int64_t vertex, std::int64_t count);
absl::Status handle_face_out_of_range(std::string_view handle, std::int64_t face, std::int64_t count);
absl::Status region_empty();
absl::Status region_vertex_out_of_range(std::int64_t vertex, std::int64_t count);

}  // namespace lpdeform
