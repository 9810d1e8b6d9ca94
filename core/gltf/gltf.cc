#include "core/gltf/gltf.h"

#include <map>
#include <new>
#include <set>
#include <type_traits>
#include <utility>

#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/gltf/document.h"
#include "core/gltf/draw_list.h"
#include "core/gltf/packing.h"
#include "core/gltf/rewrite.h"
#include "core/io/byte_order.h"
#include "core/io/mesh_io.h"
#include "core/io/whole_file.h"

namespace lpdeform::gltf {
namespace {

std::string name_of(const Json& object) {
  const Json* const name = value_of(object, "name");
  return name != nullptr && name->is_string() ? name->get<std::string>() : "";
}

/// The names under which a primitive's triangles go.
std::vector<std::string> names_of(const Json& root, const Block& block, std::size_t primitive) {
  std::vector<std::string> names{name_of(root["nodes"][block.node]), name_of(root["meshes"][block.mesh])};
  const Json* const material = value_of(root["meshes"][block.mesh]["primitives"][primitive], "material");
  if (material != nullptr && material->is_number_unsigned() &&
      material->get<std::uint64_t>() < count_of(root, "materials"))
    names.push_back(name_of(root["materials"][material->get<std::size_t>()]));
  std::erase(names, "");
  return names;
}

/// A document whose one primitive has the vertices and faces.
Document document_of(const TriangleMesh& mesh) {
  const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor> points = mesh.vertices.cast<float>();
  if (!points.allFinite()) refuse_unsupported("the mesh", "reaches beyond what glTF's numbers hold");
  std::string buffer;
  for (const float number : points.reshaped<Eigen::RowMajor>()) append_little_endian(buffer, number);
  const std::size_t faces_begin = buffer.size();
  for (const std::int32_t corner : mesh.faces.reshaped<Eigen::RowMajor>())
    append_little_endian(buffer, corner);
  Json least, most;
  for (const auto axis : points.colwise()) least.push_back(axis.minCoeff()), most.push_back(axis.maxCoeff());
  Document document;
  document.root = parse_json(
      R"({"asset": {"version": "2.0", "generator": "lpdeform"}, "scene": 0, "scenes": [{"nodes": [0]}],
    "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3"}, {"bufferView": 1, "componentType": 5125, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteOffset": 0, "target": 34962}, {"buffer": 0, "target": 34963}], "buffers": [{}]})");
  Json& root = document.root;
  root["accessors"][0].update({{"count", points.rows()}, {"min", least}, {"max", most}});
  root["accessors"][1]["count"] = mesh.faces.size();
  root["bufferViews"][0]["byteLength"] = faces_begin;
  root["bufferViews"][1].update({{"byteOffset", faces_begin}, {"byteLength", buffer.size() - faces_begin}});
  root["buffers"][0]["byteLength"] = buffer.size();
  document.buffers.push_back(std::move(buffer));
  return document;
}

/// What `work` returns, or why there is nothing.
template <typename Work>
absl::StatusOr<std::invoke_result_t<Work>> guarded(const Work& work) {
  try {
    return work();
  } catch (const Refusal& refusal) {
    return refusal.status;
  } catch (const Json::exception&) {
    return make_fault({Reason::kMeshSyntax, "the JSON", ""}, "The JSON has a value of a wrong kind.");
  } catch (const std::bad_alloc&) {
    return make_fault({Reason::kMeshUnsupported, "the file", ""},
                      "The file needs more memory than there is.");
  }
}

}  // namespace

struct Gltf::Contents {
  Document document;
  DrawList list;
};

std::optional<Packing> packing_of(const std::filesystem::path& path) {
  const std::string ending = ending_of(path);
  if (ending == ".glb") return Packing::kGlb;
  if (ending == ".gltf") return Packing::kGltf;
  return std::nullopt;
}

absl::StatusOr<Gltf> Gltf::read(const std::filesystem::path& path) {
  const auto bytes = read_whole_file(path);
  if (!bytes.ok()) return bytes.status();
  return parse(*bytes, path.parent_path());
}

absl::StatusOr<Gltf> Gltf::parse(std::string_view bytes, const std::filesystem::path& folder) {
  return guarded([&] {
    auto contents = std::make_shared<Contents>();
    contents->document = parse_document(bytes, folder);
    contents->list = read_draw_list(contents->document);
    count_of(contents->document.root, "materials");  // which groups() reads
    return Gltf(std::move(contents));
  });
}

absl::StatusOr<Gltf> Gltf::of_mesh(const TriangleMesh& mesh) {
  return guarded([&] {
    auto contents = std::make_shared<Contents>();
    contents->document = document_of(mesh);
    contents->list = read_draw_list(contents->document);
    return Gltf(std::move(contents));
  });
}

const TriangleMesh& Gltf::mesh() const {
  return contents_->list.mesh;
}

std::vector<Part> Gltf::parts() const {
  const Json& root = contents_->document.root;
  std::vector<Part> parts;
  for (const Block& block : contents_->list.blocks)
    parts.push_back(
        {name_of(root["nodes"][block.node]), name_of(root["meshes"][block.mesh]), block.first, block.count});
  return parts;
}

std::vector<NamedVertices> Gltf::groups() const {
  const DrawList& list = contents_->list;
  std::map<std::string, std::set<std::int32_t>> found;
  for (const FaceRange& range : list.ranges) {
    const auto corners = list.mesh.faces.middleRows(range.first, range.count).reshaped();
    for (const std::string& name :
         names_of(contents_->document.root, list.blocks[range.block], range.primitive))
      found[name].insert(corners.begin(), corners.end());
  }
  std::vector<NamedVertices> groups;
  for (const auto& [name, vertices] : found) groups.push_back({name, {vertices.begin(), vertices.end()}});
  return groups;
}

const std::vector<std::string>& Gltf::notices() const {
  return contents_->list.notices;
}

absl::StatusOr<std::string> Gltf::bytes(const Points& positions, Packing packing, std::optional<double> weld,
                                        bool adds_normals) const {
  return guarded([&] {
    Document result = rewritten(contents_->document, contents_->list, positions, weld, adds_normals);
    return packing == Packing::kGlb ? packed_glb(std::move(result)) : packed_gltf(std::move(result));
  });
}

}  // namespace lpdeform::gltf
