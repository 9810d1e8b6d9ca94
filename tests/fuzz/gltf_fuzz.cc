// libFuzzer: the reader of GLB and glTF files, and the writer for what it accepts. The first byte says how the result is written.

#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/check.h"
#include "core/gltf/gltf.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lpdeform;
  if (size == 0) return 0;
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto file = gltf::Gltf::parse(bytes, "/nowhere");
  if (!file.ok()) {
    LPDEFORM_CHECK(!file.status().message().empty());
    return 0;
  }
  const TriangleMesh& mesh = file->mesh();
  LPDEFORM_CHECK(mesh.faces.size() > 0 && mesh.faces.minCoeff() >= 0);
  LPDEFORM_CHECK(mesh.faces.maxCoeff() < mesh.vertices.rows());
  for (const gltf::Part& part : file->parts())
    LPDEFORM_CHECK(part.first + part.count <= mesh.vertices.rows());
  for (const gltf::NamedVertices& group : file->groups())
    for (const std::uint32_t vertex : group.vertices) LPDEFORM_CHECK(vertex < mesh.vertices.rows());

  const auto packing = data[0] & 1 ? gltf::Packing::kGltf : gltf::Packing::kGlb;
  const auto weld = data[0] & 2 ? std::optional(1e-6) : std::nullopt;
  const auto written = file->bytes(2 * mesh.vertices, packing, weld, (data[0] & 4) != 0);
  if (!written.ok()) {
    LPDEFORM_CHECK(!written.status().message().empty());
    return 0;
  }
  const auto again = gltf::Gltf::parse(*written, "/nowhere");
  LPDEFORM_CHECK(again.ok() && again->mesh().vertices.rows() == mesh.vertices.rows());
  LPDEFORM_CHECK(again->mesh().faces.rows() == mesh.faces.rows());
  return 0;
}
