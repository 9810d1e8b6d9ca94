// Decoder: meshes, positions, normals, welds.

#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/constraints/check_positions.h"
#include "server/wire/decode.h"
#include "server/wire/decode_parts.h"

namespace lpdeform {
namespace {

std::uint64_t mesh_bytes(const v1::Mesh& message, Scalar scalar) {
  return std::uint64_t{message.vertex_count()} * 3 * bytes_of(scalar) +
         std::uint64_t{message.face_count()} * 12;
}

}  // namespace

absl::Status Decoder::check_mesh_size(const v1::Mesh& message, const MeshLimits& limits) {
  if (message.vertex_count() > limits.most_vertices || message.face_count() > limits.most_faces) {
    const std::string limit =
        absl::StrCat("vertices <= ", limits.most_vertices, ", faces <= ", limits.most_faces);
    return make_fault({Reason::kMeshTooLarge, "mesh", limit},
                      absl::StrCat("The mesh has ", message.vertex_count(), " vertices and ",
                                   message.face_count(), " faces; allowed are ", limit, "."));
  }
  const auto scalar = decode_scalar(message.scalar());
  if (!scalar.ok()) return scalar.status();
  const auto data = bytes(message.data(), "mesh data");
  if (!data.ok()) return data.status();
  const std::uint64_t expected = mesh_bytes(message, *scalar);
  return data->view.size() == expected
             ? absl::OkStatus()
             : wrong_size("mesh data", data->view.size(), absl::StrCat(expected, " bytes"));
}

absl::StatusOr<TriangleMesh> Decoder::mesh(const v1::Mesh& message) {
  const auto scalar = decode_scalar(message.scalar());
  if (!scalar.ok()) return scalar.status();
  const auto data = bytes(message.data(), "mesh data");
  if (!data.ok()) return data.status();
  const std::uint64_t expected = mesh_bytes(message, *scalar);
  if (data->view.size() != expected) {
    return wrong_size("mesh data", data->view.size(), absl::StrCat(expected, " bytes"));
  }
  TriangleMesh mesh;
  mesh.vertices.resize(message.vertex_count(), 3);
  mesh.faces.resize(message.face_count(), 3);
  const std::size_t vertex_bytes = std::size_t{message.vertex_count()} * 3 * bytes_of(*scalar);
  unpack(*scalar, data->view.substr(0, vertex_bytes), mesh.vertices);
  unpack_indices(data->view.substr(vertex_bytes), std::size_t{message.face_count()} * 3, mesh.faces.data());
  return mesh;
}

Points Decoder::PackedPoints::unpack() const {
  Points points(static_cast<Eigen::Index>(count), 3);
  lpdeform::unpack(scalar, bytes.view, points);
  return points;
}

absl::StatusOr<Decoder::PackedPoints> Decoder::points(v1::Scalar wire_scalar, const v1::Buffer& buffer,
                                                      std::string_view what) {
  const auto scalar = decode_scalar(wire_scalar);
  if (!scalar.ok()) return scalar.status();
  auto data = bytes(buffer, what);
  if (!data.ok()) return data.status();
  const std::size_t point_bytes = 3 * bytes_of(*scalar);
  if (data->view.size() % point_bytes != 0) {
    return wrong_size(what, data->view.size(), absl::StrCat("a multiple of ", point_bytes));
  }
  const std::uint64_t count = data->view.size() / point_bytes;
  return PackedPoints{*scalar, *std::move(data), count};
}

absl::StatusOr<Points> Decoder::positions(const v1::Positions& message) {
  const auto packed = points(message.scalar(), message.data(), "positions");
  if (!packed.ok()) return packed.status();
  if (packed->count == vertex_count_) return packed->unpack();
  return wrong_position_count(static_cast<std::int64_t>(packed->count), vertex_count_);
}

absl::StatusOr<Points> Decoder::normals(const v1::Normals& message) {
  if (!message.has_data()) return Points(0, 3);
  const auto packed = points(message.scalar(), message.data(), "normals");
  if (!packed.ok()) return packed.status();
  if (absl::Status status = check_normal_count(packed->count, vertex_count_); !status.ok()) return status;
  Points normals = packed->unpack();
  if (absl::Status status = check_normals(normals); !status.ok()) return status;
  return normals;
}

absl::StatusOr<std::shared_ptr<const Weld>> Decoder::weld(const v1::Weld& message, const Points& positions) {
  if (message.by_case() == v1::Weld::BY_NOT_SET) return nullptr;
  if (message.has_position()) {
    auto weld = weld_by_position(positions, message.position().tolerance());
    if (!weld.ok()) return weld.status();
    return std::make_shared<const Weld>(*std::move(weld));
  }
  const auto data = bytes(message.groups(), "weld groups");
  if (!data.ok()) return data.status();
  if (data->view.size() % sizeof(std::uint32_t) != 0)
    return wrong_size("weld groups", data->view.size(), "a multiple of 4");
  std::vector<std::uint32_t> groups(data->view.size() / sizeof(std::uint32_t));
  for (std::size_t k = 0; k < groups.size(); ++k) groups[k] = packed_index(data->view, k);
  auto weld = weld_by_groups(positions, groups);
  if (!weld.ok()) return weld.status();
  return std::make_shared<const Weld>(*std::move(weld));
}

}  // namespace lpdeform
