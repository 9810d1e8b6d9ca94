// Decoder: handles and the region of interest.

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/wire/decode.h"
#include "server/wire/decode_parts.h"
#include "server/wire/holds.h"
#include "server/wire/vectors.h"

namespace lpdeform {

absl::StatusOr<HandleMotion> Decoder::motion(const v1::Motion& message) {
  if (message.has_fixed()) return Fixed{};
  if (message.has_rigid()) {
    const v1::RigidMotion& rigid = message.rigid();
    return RigidMotion{decode_vector(rigid.axis()), rigid.angle_radians(), decode_vector(rigid.center()),
                       decode_vector(rigid.translation())};
  }
  if (!message.has_targets()) {
    return make_fault({Reason::kMotionMissing, "motion", ""}, "A motion must set fixed, rigid or targets.");
  }
  const auto targets = points(message.targets().scalar(), message.targets().positions(), "target positions");
  if (!targets.ok()) return targets.status();
  if (absl::Status status = room_for_targets_.take(targets->count, "target positions"); !status.ok())
    return status;
  return TargetPositions{targets->unpack()};
}

absl::StatusOr<std::vector<std::int32_t>> Decoder::indices(const v1::Buffer& buffer, std::string_view what,
                                                           GivenRoom& room, const OutOfRange& out_of_range) {
  const auto data = bytes(buffer, what);
  if (!data.ok()) return data.status();
  if (data->view.size() % sizeof(std::uint32_t) != 0) {
    return wrong_size(what, data->view.size(), "a multiple of 4");
  }
  const std::size_t count = data->view.size() / sizeof(std::uint32_t);
  if (absl::Status status = room.take(count, what); !status.ok()) return status;
  for (std::size_t k = 0; k < count; ++k) {
    if (packed_index(data->view, k) > kMostIndex) return out_of_range(packed_index(data->view, k));
  }
  std::vector<std::int32_t> result(count);
  unpack_indices(data->view, count, result.data());
  return result;
}

absl::StatusOr<std::vector<SurfacePoint>> Decoder::surface_points(const v1::SurfacePoints& message,
                                                                  const std::string& name) {
  const auto faces =
      indices(message.faces(), "handle points", room_for_vertices_, [this, &name](std::uint32_t face) {
        return handle_face_out_of_range(name, face, features_ ? features_->shape().face_count() : kMostIndex);
      });
  if (!faces.ok()) return faces.status();
  const auto coordinates = points(message.scalar(), message.barycentric(), "barycentric coordinates");
  if (!coordinates.ok()) return coordinates.status();
  if (absl::Status status = check_point_count(3 * coordinates->count, faces->size()); !status.ok())
    return status;
  const Points barycentric = coordinates->unpack();
  std::vector<SurfacePoint> result(faces->size());
  for (std::size_t k = 0; k < result.size(); ++k) {
    result[k] = {(*faces)[k], barycentric.row(static_cast<Eigen::Index>(k)).transpose()};
  }
  return result;
}

absl::StatusOr<std::vector<std::int32_t>> Decoder::region(const v1::RegionOfInterest& message) {
  if (!message.has_vertices()) return std::vector<std::int32_t>{};
  auto vertices =
      indices(message.vertices(), "region vertices", room_for_region_,
              [this](std::uint32_t vertex) { return region_vertex_out_of_range(vertex, vertex_count_); });
  if (!vertices.ok() || !vertices->empty()) return vertices;
  return region_empty();
}

absl::StatusOr<Handle> Decoder::group(const v1::Handle& message, const std::string& name) {
  Handle handle;
  if (message.has_vertices() || !message.has_points()) {
    auto vertices = indices(message.vertices(), "handle vertices", room_for_vertices_,
                            [this, &name](std::uint32_t vertex) {
                              return handle_vertex_out_of_range(name, vertex, vertex_count_);
                            });
    if (!vertices.ok()) return vertices.status();
    handle.vertices = *std::move(vertices);
  }
  if (message.has_points()) {
    auto points = surface_points(message.points(), name);
    if (!points.ok()) return points.status();
    handle.points = *std::move(points);
  }
  if (message.has_motion()) {
    auto moved = motion(message.motion());
    if (!moved.ok()) return moved.status();
    handle.motion = *std::move(moved);
  }
  handle.hold = decode_hold(message);
  handle.footprint = message.footprint_radius();
  return handle;
}

absl::StatusOr<HandleChange> Decoder::handle(const v1::HandleUpdate& message) {
  HandleChange out{message.name(), Removal{}};
  if (message.has_remove()) return out;
  if (message.has_move()) {
    auto moved = motion(message.move());
    if (!moved.ok()) return moved.status();
    out.change = *std::move(moved);
    return out;
  }
  if (!message.has_set()) {
    return make_fault({Reason::kHandleChangeMissing, "handles", ""},
                      "A change must set, move or remove the handle.");
  }
  auto handle = group(message.set(), message.name());
  if (!handle.ok()) return handle.status();
  out.change = *std::move(handle);
  return out;
}

absl::Status Decoder::handles(const google::protobuf::RepeatedPtrField<v1::HandleUpdate>& messages,
                              Update& out) {
  for (const v1::HandleUpdate& message : messages) {
    auto change = handle(message);
    if (!change.ok()) return change.status();
    out.handles.push_back(*std::move(change));
  }
  return absl::OkStatus();
}

}  // namespace lpdeform
