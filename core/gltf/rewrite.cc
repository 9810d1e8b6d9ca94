#include "core/gltf/rewrite.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <set>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/gltf/accessors.h"
#include "core/gltf/places.h"
#include "core/io/byte_order.h"
#include "core/mesh/carried_normals.h"

namespace lpdeform::gltf {
namespace {

using Floats = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kSameDirection = 1e-6;  // single precision rounds a direction by less
constexpr int kVertexData = 34962;       // the "target" of a bufferView

auto rows_of(const Points& points, const Block& block) {
  return points.middleRows(block.first, block.count);
}

Eigen::RowVector3d unit(const Eigen::RowVector3d& vector) {
  const double length = vector.norm();
  return length > 0 && std::isfinite(length) ? Eigen::RowVector3d(vector / length)
                                             : Eigen::RowVector3d(0, 0, 0);
}

/// The directions of an attribute where the blocks draw them; 0 where a block has none.
Points directions_at_rest(const Document& document, const DrawList& list, bool are_tangents) {
  Points all = Points::Zero(list.mesh.vertices.rows(), 3);
  for (const Block& block : list.blocks) {
    const auto& accessor = are_tangents ? block.attributes.tangent : block.attributes.normal;
    if (!accessor) continue;
    const Eigen::Matrix3d linear = block.placement.linear();
    const Eigen::Matrix3d to_world = are_tangents ? linear : Eigen::Matrix3d(linear.inverse().transpose());
    const Table local = read_table(document, *accessor, are_tangents ? 4 : 3);
    for (Eigen::Index k = 0; k < block.count; ++k) {
      const Eigen::RowVector3d drawn = unit(local.row(k).head<3>() * to_world.transpose());
      if (drawn.allFinite()) all.row(block.first + k) = drawn;
    }
  }
  return all;
}

Weld weld_of(const Points& points, const std::optional<double>& tolerance) {
  if (!tolerance) return no_weld(static_cast<std::int32_t>(points.rows()));
  auto weld = weld_by_position(points, *tolerance);
  if (!weld.ok()) throw Refusal{weld.status()};
  return *std::move(weld);
}

std::vector<std::size_t> accessors_of(const Attributes& attributes) {
  std::vector<std::size_t> accessors{attributes.position};
  for (const auto& other : {attributes.normal, attributes.tangent}) {
    if (other) accessors.push_back(*other);
  }
  return accessors;
}

class Rewriter {
 public:
  Rewriter(const Document& document, const DrawList& list, const Points& positions,
           const std::optional<double>& weld)
      : document_(document),
        list_(list),
        rest_(list.mesh.vertices),
        positions_(positions),
        weld_(weld_of(rest_, weld)),
        places_(document, list),
        out_(document) {
    for (const Block& block : list_.blocks) first_node_of_mesh_.try_emplace(block.mesh, block.node);
  }

  Document write(bool adds_normals) {
    const auto has = [&](auto attribute) {
      return std::ranges::any_of(
          list_.blocks, [&](const Block& block) { return (block.attributes.*attribute).has_value(); });
    };
    if (adds_normals || has(&Attributes::normal)) normals_ = turned(false);
    if (has(&Attributes::tangent)) tangents_ = turned(true);
    const std::set<std::size_t> touched = find_touched();
    const auto is_touched = [&](std::size_t accessor) { return touched.contains(accessor); };
    for (const Block& block : list_.blocks) {
      const bool is_new = adds_normals && !block.attributes.normal;
      if (!is_new && std::ranges::none_of(accessors_of(block.attributes), is_touched)) continue;
      write_positions(block);
      if (block.attributes.normal || is_new) write_normals(block);
      if (block.attributes.tangent) write_tangents(block);
    }
    return std::move(out_);
  }

 private:
  /// The accessors of blocks that have moved.
  std::set<std::size_t> find_touched() const {
    std::set<std::size_t> touched;
    for (const Block& block : list_.blocks) {
      if (rows_of(positions_, block) == rows_of(rest_, block)) continue;
      for (const std::size_t accessor : accessors_of(block.attributes)) touched.insert(accessor);
    }
    return touched;
  }

  Points turned(bool are_tangents) const {
    const Points at_rest = directions_at_rest(document_, list_, are_tangents);
    return CarriedNormals(list_.mesh.faces, rest_, weld_, at_rest).at(positions_);
  }

  void write_positions(const Block& block) {
    Floats values = read_table(document_, block.attributes.position, 3).cast<float>();
    const Eigen::Affine3d to_local = block.placement.inverse();
    for (Eigen::Index k = 0; k < block.count; ++k) {
      const Eigen::Index vertex = block.first + k;
      if (positions_.row(vertex) == rest_.row(vertex)) continue;
      values.row(k) = (to_local * positions_.row(vertex).transpose()).transpose().cast<float>();
      if (!values.row(k).allFinite())
        refuse_unsupported(absl::StrCat("vertex ", vertex), "lies beyond what glTF's numbers hold");
    }
    put(block, "POSITION", block.attributes.position, values);
  }

  /// In the mesh's own coordinates, of length 1.
  Eigen::RowVector3d local_normal(const Block& block, Eigen::Index k) const {
    return unit(normals_.row(block.first + k) * block.placement.linear());
  }

  void write_normals(const Block& block) {
    Floats values = Floats::Zero(block.count, 3);
    if (block.attributes.normal) values = read_table(document_, *block.attributes.normal, 3).cast<float>();
    for (Eigen::Index k = 0; k < block.count; ++k) {
      const Eigen::RowVector3d normal = local_normal(block, k);
      const Eigen::RowVector3d before = unit(values.row(k).cast<double>());
      const bool is_none = normal.isZero(0);  // a vertex that no face with an area uses
      if (!is_none && !(normal - before).isZero(kSameDirection)) values.row(k) = normal.cast<float>();
      if (is_none && before.isZero(0)) values.row(k).setZero(), values(k, 2) = 1;
    }
    put(block, "NORMAL", block.attributes.normal, values);
  }

  /// At right angles to the normals, as they were. The fourth number says which way the bitangent points; it stays.
  void write_tangents(const Block& block) {
    Floats values = read_table(document_, *block.attributes.tangent, 4).cast<float>();
    const Eigen::Matrix3d to_local = block.placement.linear().inverse();
    for (Eigen::Index k = 0; k < block.count; ++k) {
      Eigen::RowVector3d tangent = unit(tangents_.row(block.first + k) * to_local.transpose());
      const Eigen::RowVector3d before = unit(values.row(k).head<3>().cast<double>());
      if (block.attributes.normal) {
        const Eigen::RowVector3d normal = local_normal(block, k);
        tangent = unit(tangent - tangent.dot(normal) * normal);
      }
      if (tangent.isZero(0) || before.isZero(0) || (tangent - before).isZero(kSameDirection)) continue;
      values.row(k).head<3>() = tangent.cast<float>();
    }
    put(block, "TANGENT", block.attributes.tangent, values);
  }

  void put(const Block& block, const char* key, const std::optional<std::size_t>& accessor,
           const Floats& values) {
    if (accessor && places_.take(*accessor)) {
      overwrite(*accessor, values);
      set_bounds(out_.root["accessors"][*accessor], key, values);
      return;
    }
    const std::size_t added = add_accessor(key, values);
    if (accessor && value_of(document_.root["accessors"][*accessor], "name") != nullptr)
      out_.root["accessors"][added]["name"] = document_.root["accessors"][*accessor]["name"];
    Json& primitives = out_.root["meshes"][own_mesh(block)]["primitives"];
    for (const std::size_t primitive : block.primitives) primitives[primitive]["attributes"][key] = added;
  }

  void overwrite(std::size_t accessor, const Floats& values) {
    const Layout layout = layout_of(document_, accessor);
    char* const bytes = out_.buffers[layout.buffer].data() + layout.begin;
    for (std::uint64_t k = 0; k < layout.count; ++k) {
      std::string element;
      for (const float value : values.row(static_cast<Eigen::Index>(k))) append_little_endian(element, value);
      std::memcpy(bytes + k * layout.stride, element.data(), element.size());
    }
  }

  std::size_t add_accessor(const char* key, const Floats& values) {
    std::string& buffer = out_.buffers.at(0);
    buffer.append((4 - buffer.size() % 4) % 4, '\0');
    const std::size_t begin = buffer.size();
    for (const float value : values.reshaped<Eigen::RowMajor>()) append_little_endian(buffer, value);
    Json& views = out_.root["bufferViews"];
    views.push_back({{"buffer", 0U},  // unsigned, as numbers of a file are
                     {"byteOffset", begin},
                     {"byteLength", buffer.size() - begin},
                     {"target", kVertexData}});
    Json accessor{{"bufferView", views.size() - 1},
                  {"componentType", kFloat},
                  {"count", values.rows()},
                  {"type", values.cols() == 3 ? "VEC3" : "VEC4"}};
    set_bounds(accessor, key, values);
    out_.root["accessors"].push_back(std::move(accessor));
    return out_.root["accessors"].size() - 1;
  }

  /// Positions must have "min" and "max"; other accessors may.
  static void set_bounds(Json& accessor, std::string_view key, const Floats& values) {
    for (const bool is_min : {true, false}) {
      const char* const name = is_min ? "min" : "max";
      if (values.rows() == 0 || (key != "POSITION" && !accessor.contains(name))) continue;
      Json bounds = Json::array();
      for (const auto column : values.colwise())
        bounds.push_back(double{is_min ? column.minCoeff() : column.maxCoeff()});
      accessor[name] = std::move(bounds);
    }
  }

  /// The mesh that the block's node alone draws: a copy, unless the node is the first and the only ones are blocks.
  std::size_t own_mesh(const Block& block) {
    const auto [found, is_new] = mesh_of_node_.try_emplace(block.node, block.mesh);
    if (!is_new) return found->second;
    if (first_node_of_mesh_.at(block.mesh) == block.node && !places_.is_mesh_elsewhere(block.mesh))
      return found->second;
    out_.root["meshes"].push_back(document_.root["meshes"][block.mesh]);
    found->second = out_.root["meshes"].size() - 1;
    out_.root["nodes"][block.node]["mesh"] = found->second;
    return found->second;
  }

  const Document& document_;
  const DrawList& list_;
  const Points& rest_;
  const Points& positions_;
  const Weld weld_;
  Places places_;
  Document out_;
  Points normals_, tangents_;
  std::map<std::size_t, std::size_t> mesh_of_node_, first_node_of_mesh_;
};

}  // namespace

Document rewritten(const Document& document, const DrawList& list, const Points& positions,
                   std::optional<double> weld, bool adds_normals) {
  LPDEFORM_CHECK(positions.rows() == list.mesh.vertices.rows());
  return Rewriter(document, list, positions, weld).write(adds_normals);
}

}  // namespace lpdeform::gltf
