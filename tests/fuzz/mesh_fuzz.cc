// libFuzzer: the readers of meshes, and the processing of meshes that they accept. The first byte is the format.

#include <cstdint>
#include <string_view>

#include "core/base/check.h"
#include "core/energy/rest_shape.h"
#include "core/io/mesh_io.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace lpdeform;
  if (size == 0) return 0;
  const auto format = static_cast<MeshFormat>(data[0] % 4);
  const std::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  const auto file = parse_mesh(bytes, format);
  if (!file.ok()) {
    LPDEFORM_CHECK(!file.status().message().empty());
    return 0;
  }
  const auto shape =
      RestShape::create(file->mesh, data[0] & 4 ? WeightKind::kIntrinsicDelaunay : WeightKind::kCotangent);
  if (shape.ok()) LPDEFORM_CHECK((*shape)->scaled_positions().allFinite());
  if (format == MeshFormat::kObj && file->mesh.vertices.allFinite()) {
    const auto again = parse_mesh(obj_text(*file, file->mesh.vertices), format);
    LPDEFORM_CHECK(again.ok() && again->mesh.vertices == file->mesh.vertices &&
                   again->mesh.faces == file->mesh.faces);
  }
  return 0;
}
