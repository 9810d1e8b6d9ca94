#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <vector>

#include "core/gltf/accessors.h"
#include "core/gltf/draw_list.h"

namespace lpdeform::gltf {

/// Tells where new values may lie in a file of which everything else must stay as it is.
class Places {
 public:
  /// Neither is changed while this lives.
  Places(const Document& document, const DrawList& list);

  /// Whether new values may overwrite the accessor's: it holds floats, whose bytes nothing but this accessor names, and nothing
  /// but blocks of the list uses it, the first of which asks now. True once at most for each accessor.
  bool take(std::size_t accessor);

  /// Whether the mesh is also drawn by something that is no block of the list, so that it must stay as it is.
  bool is_mesh_elsewhere(std::size_t mesh) const { return meshes_elsewhere_.contains(mesh); }

 private:
  void find_meshes(const DrawList& list);
  void find_uses(const DrawList& list);
  void find_uses_within(const Json& value);
  void add_use(const Json& value);
  void find_views();
  std::ptrdiff_t views_within(const Layout& layout) const;
  const std::set<std::size_t>& alone_in(std::size_t view);
  bool has_bytes_alone(std::size_t accessor);

  const Document& document_;
  std::set<std::size_t> meshes_elsewhere_, used_elsewhere_, taken_;
  struct Bounds {
    std::vector<std::uint64_t> begins, ends;  // each sorted
  };
  std::map<std::size_t, Bounds> bounds_of_views_;  // by buffer
  std::map<std::size_t, std::vector<std::size_t>> accessors_of_view_;
  std::map<std::size_t, std::set<std::size_t>>
      alone_in_view_;                  // accessors that share no byte; made when asked for
  std::set<std::size_t> other_views_;  // views that something else than an accessor's "bufferView" names
};

}  // namespace lpdeform::gltf
