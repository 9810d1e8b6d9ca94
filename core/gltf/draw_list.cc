#include "core/gltf/draw_list.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/gltf/accessors.h"
#include "core/gltf/node_tree.h"

namespace lpdeform::gltf {
namespace {

constexpr std::uint64_t kTriangles = 4, kStrip = 5, kFan = 6;  // a "mode"
constexpr std::size_t kMostCorners = 3 * 2 * kMostElements, kMostPrimitives = 1'000'000;

std::optional<std::size_t> attribute(const Json& root, const Json& attributes, const char* key,
                                     const std::string& part) {
  if (value_of(attributes, key) == nullptr) return std::nullopt;
  return needed_index(root, attributes, key, "accessors", part);
}

class Reader {
 public:
  explicit Reader(const Document& document)
      : document_(document), root_(document.root), tree_(read_nodes(document)) {}

  DrawList read() {
    for (const std::size_t node : tree_.in_scene) {
      if (value_of(item(root_, "nodes", node), "mesh") != nullptr) read_node(node);
    }
    check_compressions(document_);
    if (corners_.empty()) refuse("the scene", "has no triangles that could be deformed");
    list_.mesh.faces =
        Eigen::Map<const Faces>(corners_.data(), static_cast<Eigen::Index>(corners_.size() / 3), 3);
    list_.mesh.vertices.resize(vertex_count_, 3);
    for (const Block& block : list_.blocks) {
      const Table local = read_table(document_, block.attributes.position, 3);
      list_.mesh.vertices.middleRows(block.first, block.count) =
          (local * block.placement.linear().transpose()).rowwise() +
          block.placement.translation().transpose();
    }
    return std::move(list_);
  }

 private:
  void read_node(std::size_t node) {
    const Json& object = item(root_, "nodes", node);
    const std::string part = part_name(root_, "nodes", node);
    const Json* const extensions = value_of(object, "extensions");
    if (extensions != nullptr && value_of(*extensions, "EXT_mesh_gpu_instancing") != nullptr)
      refuse_unsupported(part, "draws its mesh many times by EXT_mesh_gpu_instancing, which is not read");
    const std::size_t mesh = needed_index(root_, object, "mesh", "meshes", part);
    const Eigen::Affine3d placed = placement(document_, tree_, node, of_skins_);
    const double size = placed.linear().norm();
    if (!(std::abs(placed.linear().determinant()) > 1e-12 * size * size * size) || !std::isfinite(size)) {
      list_.notices.push_back(
          absl::StrCat("What ", part, " draws is flattened by its scale, and stays as it is."));
      return;
    }
    const Json* const primitives = value_of(item(root_, "meshes", mesh), "primitives");
    if (primitives == nullptr || !primitives->is_array())
      refuse(part_name(root_, "meshes", mesh), "has no \"primitives\"");
    primitives_read_ += primitives->size();
    if (primitives_read_ > kMostPrimitives)
      refuse_unsupported("the scene", absl::StrCat("draws more than ", kMostPrimitives, " primitives"));
    block_of_.clear();
    for (std::size_t k = 0; k < primitives->size(); ++k) {
      const std::string name = absl::StrCat("primitive ", k, " of ", part_name(root_, "meshes", mesh));
      read_primitive((*primitives)[k], name, Block{node, mesh, {}, {k}, placed, 0, 0});
    }
  }

  void read_primitive(const Json& primitive, const std::string& part, Block block) {
    const Json* const extensions = value_of(primitive, "extensions");
    if (extensions != nullptr && value_of(*extensions, "KHR_draco_mesh_compression") != nullptr)
      refuse_unsupported(part, "is compressed by KHR_draco_mesh_compression, which is not read");
    const std::uint64_t mode = whole(primitive, "mode", kTriangles, part);
    if (mode != kTriangles && mode != kStrip && mode != kFan) {
      notice_once(block.mesh, block.primitives[0],
                  absl::StrCat("The ", mode == 0 ? "points" : "lines", " of ", part, " stay as they are."));
      return;
    }
    const Json* const attributes = value_of(primitive, "attributes");
    const auto position =
        attributes != nullptr ? attribute(root_, *attributes, "POSITION", part) : std::nullopt;
    if (!position) {
      notice_once(block.mesh, block.primitives[0],
                  absl::StrCat("There are no positions in ", part, ": it stays as it is."));
      return;
    }
    block.attributes = {*position, attribute(root_, *attributes, "NORMAL", part),
                        attribute(root_, *attributes, "TANGENT", part)};
    const std::size_t mesh = block.mesh, number = block.primitives[0],
                      own = add_block(std::move(block), part);
    const auto first_face = static_cast<Eigen::Index>(corners_.size() / 3);
    const auto corners = corner_list(primitive, static_cast<std::uint64_t>(list_.blocks[own].count), part);
    add_triangles(corners, mode, list_.blocks[own]);
    const std::size_t rest = mode == kTriangles   ? corners.size() % 3
                             : corners.size() < 3 ? corners.size()
                                                  : 0;
    if (rest > 0)
      notice_once(mesh, number,
                  absl::StrCat("Corners at the end of ", part, " make no triangle: ", rest, " of ",
                               corners.size(), "."));
    list_.ranges.push_back(
        {own, number, first_face, static_cast<Eigen::Index>(corners_.size() / 3) - first_face});
  }

  /// However many nodes draw the primitive.
  void notice_once(std::size_t mesh, std::size_t primitive, std::string notice) {
    if (noticed_.insert({mesh, primitive}).second) list_.notices.push_back(std::move(notice));
  }

  std::size_t add_block(Block block, const std::string& part) {
    const auto [found, is_new] = block_of_.try_emplace(block.attributes, list_.blocks.size());
    if (!is_new) {
      list_.blocks[found->second].primitives.push_back(block.primitives[0]);
      return found->second;
    }
    block.first = vertex_count_;
    block.count = static_cast<Eigen::Index>(element_count(root_, block.attributes.position));
    layout_of(document_, block.attributes.position);
    for (const auto& other : {block.attributes.normal, block.attributes.tangent}) {
      if (other && element_count(root_, *other) != static_cast<std::uint64_t>(block.count))
        refuse(part, "has attributes of different lengths");
    }
    vertex_count_ += block.count;
    if (vertex_count_ > static_cast<Eigen::Index>(kMostElements))
      refuse_unsupported("the scene", absl::StrCat("has more than ", kMostElements, " vertices"));
    list_.blocks.push_back(std::move(block));
    return list_.blocks.size() - 1;
  }

  std::vector<std::uint32_t> corner_list(const Json& primitive, std::uint64_t count,
                                         const std::string& part) {
    if (value_of(primitive, "indices") == nullptr) {
      std::vector<std::uint32_t> all(count);
      for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<std::uint32_t>(k);
      return all;
    }
    std::vector<std::uint32_t> indices =
        read_indices(document_, needed_index(root_, primitive, "indices", "accessors", part));
    const auto wrong = std::ranges::find_if(indices, [&](std::uint32_t index) { return index >= count; });
    if (wrong != indices.end())
      refuse(part,
             absl::StrCat("names by index ", wrong - indices.begin(), " vertex ", *wrong, " of ", count));
    return indices;
  }

  void add_triangles(const std::vector<std::uint32_t>& corners, std::uint64_t mode, const Block& block) {
    corners_read_ += corners.size();
    if (corners_read_ > kMostCorners)
      refuse_unsupported("the scene", absl::StrCat("has more than ", kMostCorners / 3, " triangles"));
    const std::size_t step = mode == kTriangles ? 3 : 1;
    const bool is_mirrored = block.placement.linear().determinant() < 0;
    for (std::size_t k = 0; k + 2 < corners.size(); k += step) {
      std::uint32_t a = corners[mode == kFan ? 0 : k], b = corners[k + 1], c = corners[k + 2];
      if (mode == kStrip && k % 2 == 1) std::swap(b, c);
      if (is_mirrored) std::swap(b, c);
      if (mode != kTriangles && (a == b || b == c || c == a))
        continue;  // strips are joined by such triangles
      for (const std::uint32_t corner : {a, b, c})
        corners_.push_back(static_cast<std::int32_t>(block.first + corner));
    }
  }

  const Document& document_;
  const Json& root_;
  const NodeTree tree_;
  std::map<std::size_t, Eigen::Affine3d> of_skins_;
  DrawList list_;
  Eigen::Index vertex_count_ = 0;
  std::size_t corners_read_ = 0, primitives_read_ = 0;
  std::map<Attributes, std::size_t> block_of_;             // of the node that is read
  std::set<std::pair<std::size_t, std::size_t>> noticed_;  // meshes and their primitives
  std::vector<std::int32_t> corners_;
};

}  // namespace

DrawList read_draw_list(const Document& document) {
  return Reader(document).read();
}

}  // namespace lpdeform::gltf
