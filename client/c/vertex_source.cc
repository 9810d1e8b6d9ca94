#include "client/c/vertex_source.h"

#include <cstring>

#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {
namespace {

template <typename Number>
std::vector<double> read_triples(const lpdeform_source& source, std::size_t count) {
  std::vector<double> out;
  out.reserve(3 * count);
  const std::size_t stride = source.stride == 0 ? 3 * sizeof(Number) : source.stride;
  const auto* const first = static_cast<const unsigned char*>(source.data) + source.offset;
  for (std::size_t i = 0; i < count; ++i) {
    Number triple[3];
    std::memcpy(triple, first + i * stride, sizeof triple);
    out.insert(out.end(), {double(triple[0]), double(triple[1]), double(triple[2])});
  }
  return out;
}

absl::StatusOr<std::vector<double>> read_triples(const std::string& name, const lpdeform_source& source,
                                                 std::uint32_t count) {
  const absl::Status reserved = check_reserved(name, source.reserved);
  if (!reserved.ok()) return reserved;
  if (source.format != LPDEFORM_FLOAT32 && source.format != LPDEFORM_FLOAT64) {
    return make_fault(
        {Reason::kFormatUnknown, name, "FLOAT32 or FLOAT64"},
        absl::StrCat("The format of ", name, " is ", source.format, " and neither FLOAT32 nor FLOAT64."));
  }
  const bool is_double = source.format == LPDEFORM_FLOAT64;
  const absl::Status checked = check_extent(name, source.bytes, source.offset, source.stride,
                                            3 * (is_double ? sizeof(double) : sizeof(float)), count);
  if (!checked.ok()) return checked;
  return is_double ? read_triples<double>(source, count) : read_triples<float>(source, count);
}

template <typename Index>
std::vector<std::uint32_t> read_indices(const lpdeform_mesh& mesh, bool turns_triangles) {
  std::vector<Index> indices(mesh.index_count);
  if (!indices.empty()) std::memcpy(indices.data(), mesh.indices, indices.size() * sizeof(Index));
  std::vector<std::uint32_t> out(indices.begin(), indices.end());
  if (turns_triangles) {
    for (std::size_t corner = 0; corner < out.size(); corner += 3)
      std::swap(out[corner + 1], out[corner + 2]);
  }
  return out;
}

absl::Status check_indices(const lpdeform_mesh& mesh) {
  if (mesh.indices == nullptr && mesh.index_count > 0) return argument_missing("mesh.indices");
  if (mesh.index_count % 3 != 0) {
    return make_fault({Reason::kIndexCount, "mesh.index_count", "index_count % 3 = 0"},
                      absl::StrCat(mesh.index_count, " indices are not three a triangle."));
  }
  if (mesh.index_format != LPDEFORM_UINT32 && mesh.index_format != LPDEFORM_UINT16) {
    return make_fault(
        {Reason::kFormatUnknown, "mesh.index_format", "UINT32 or UINT16"},
        absl::StrCat("The format of mesh.indices is ", mesh.index_format, " and neither UINT32 nor UINT16."));
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status check_extent(const std::string& name, std::size_t bytes, std::uint32_t offset,
                          std::uint32_t stride, std::uint32_t size, std::uint32_t count) {
  const std::uint64_t step = stride == 0 ? size : stride;
  if (step < size) {
    return make_fault(
        {Reason::kStrideTooSmall, name, absl::StrCat("stride >= ", size)},
        absl::StrCat("The stride of ", name, " is ", stride, " bytes, its elements have ", size, "."));
  }
  // Each factor is below 2^32, so the result fits into 64 bits, but perhaps not into a size_t.
  const std::uint64_t needed = count == 0 ? 0 : offset + (count - 1) * step + size;
  if (needed <= bytes) return absl::OkStatus();
  return make_fault({Reason::kBufferTooSmall, name, absl::StrCat("bytes >= ", needed)},
                    absl::StrCat("The buffer of ", name, " has ", bytes, " bytes; ", count, " vertices need ",
                                 needed, "."));
}

absl::StatusOr<client::Mesh> read_mesh(const lpdeform_mesh& mesh, const Space& space) {
  if (mesh.positions.data == nullptr && mesh.vertex_count > 0) return argument_missing("mesh.positions.data");
  absl::Status checked = check_indices(mesh);
  checked.Update(check_reserved("mesh", mesh.reserved));
  if (!checked.ok()) return checked;

  client::Mesh out;
  auto positions = read_triples("mesh.positions", mesh.positions, mesh.vertex_count);
  if (!positions.ok()) return positions.status();
  out.vertices = *std::move(positions);
  if (mesh.normals.data != nullptr) {
    auto normals = read_triples("mesh.normals", mesh.normals, mesh.vertex_count);
    if (!normals.ok()) return normals.status();
    out.normals = *std::move(normals);
  }
  for (std::size_t i = 0; i < out.vertices.size(); i += 3) {
    const Vector at = space.point_to_server({out.vertices[i], out.vertices[i + 1], out.vertices[i + 2]});
    std::copy(at.begin(), at.end(), out.vertices.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (std::size_t i = 0; i < out.normals.size(); i += 3) {
    const Vector normal = space.direction_to_server({out.normals[i], out.normals[i + 1], out.normals[i + 2]});
    std::copy(normal.begin(), normal.end(), out.normals.begin() + static_cast<std::ptrdiff_t>(i));
  }
  out.faces = mesh.index_format == LPDEFORM_UINT16
                  ? read_indices<std::uint16_t>(mesh, space.turns_triangles())
                  : read_indices<std::uint32_t>(mesh, space.turns_triangles());
  return out;
}

client::Weld read_weld(const lpdeform_mesh& mesh) {
  client::Weld weld;
  weld.by_position = mesh.weld_by_position != 0;
  weld.tolerance = mesh.weld_tolerance;
  if (mesh.weld_groups != nullptr) weld.groups.assign(mesh.weld_groups, mesh.weld_groups + mesh.vertex_count);
  return weld;
}

}  // namespace lpdeform::engine
