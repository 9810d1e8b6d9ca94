#include "server/keeping/encode_stored.h"

#include <bit>
#include <string>

#include "server/wire/encode.h"
#include "server/wire/holds.h"
#include "server/wire/vectors.h"

namespace lpdeform {
namespace {

static_assert(std::endian::native == std::endian::little, "buffers are little-endian");

template <typename Number>
void pack(const Number* numbers, std::size_t count, v1::Buffer& out) {
  out.set_inline_(numbers, count * sizeof(Number));
}

void encode_points(const std::vector<SurfacePoint>& points, v1::SurfacePoints& out) {
  std::vector<std::int32_t> faces;
  std::vector<double> barycentric;
  for (const SurfacePoint& point : points) {
    faces.push_back(point.face);
    barycentric.insert(barycentric.end(), point.barycentric.data(), point.barycentric.data() + 3);
  }
  pack(faces.data(), faces.size(), *out.mutable_faces());
  out.set_scalar(v1::SCALAR_FLOAT64);
  pack(barycentric.data(), barycentric.size(), *out.mutable_barycentric());
}

struct MotionEncoder {
  v1::Motion& out;
  void operator()(const Fixed&) const { out.mutable_fixed(); }
  void operator()(const RigidMotion& motion) const {
    v1::RigidMotion& rigid = *out.mutable_rigid();
    encode_vector(motion.axis, *rigid.mutable_axis());
    rigid.set_angle_radians(motion.angle_radians);
    encode_vector(motion.center, *rigid.mutable_center());
    encode_vector(motion.translation, *rigid.mutable_translation());
  }
  void operator()(const TargetPositions& targets) const {
    out.mutable_targets()->set_scalar(v1::SCALAR_FLOAT64);
    pack(targets.positions.data(), static_cast<std::size_t>(targets.positions.size()),
         *out.mutable_targets()->mutable_positions());
  }
};

void append(const void* numbers, std::size_t bytes, std::string& out) {
  out.append(static_cast<const char*>(numbers), bytes);
}

/// Encodes each vertex as its lowest copy.
void encode_weld(const Weld& weld, v1::Weld& out) {
  std::vector<std::int32_t> lowest;
  for (const std::int32_t welded : weld.to_welded) lowest.push_back(weld.first_copy[welded]);
  pack(lowest.data(), lowest.size(), *out.mutable_groups());
}

}  // namespace

void encode_mesh(const SessionInfo& session, v1::CreateSessionRequest& out) {
  const Points vertices = session.mesh->positions(session.shape->positions());
  const Faces& faces = session.mesh->faces();
  v1::Mesh& mesh = *out.mutable_mesh();
  mesh.set_vertex_count(session.mesh->vertex_count());
  mesh.set_face_count(static_cast<std::uint32_t>(faces.rows()));
  mesh.set_scalar(v1::SCALAR_FLOAT64);
  std::string& data = *mesh.mutable_data()->mutable_inline_();
  data.reserve(vertices.size() * sizeof(double) + faces.size() * sizeof(std::int32_t));
  append(vertices.data(), vertices.size() * sizeof(double), data);
  append(faces.data(), faces.size() * sizeof(std::int32_t), data);
  out.set_weights(encode_weights(session.shape->weight_kind()));
  out.set_free_components(encode_free_components(session.free_components));
  if (session.mesh->weld()) encode_weld(*session.mesh->weld(), *out.mutable_weld());
  const Points& normals = session.mesh->rest_normals();
  if (normals.rows() == 0) return;
  out.mutable_normals()->set_scalar(v1::SCALAR_FLOAT64);
  pack(normals.data(), static_cast<std::size_t>(normals.size()), *out.mutable_normals()->mutable_data());
}

void encode_positions(const Points& positions, v1::Positions& out) {
  out.set_scalar(v1::SCALAR_FLOAT64);
  pack(positions.data(), static_cast<std::size_t>(positions.size()), *out.mutable_data());
}

v1::Field encode_whole_field(const Field& field) {
  v1::Field out;
  if (field.size() == 1) {
    out.set_uniform(field[0]);
  } else {
    out.mutable_per_vertex()->set_scalar(v1::SCALAR_FLOAT64);
    pack(field.data(), static_cast<std::size_t>(field.size()), *out.mutable_per_vertex()->mutable_values());
  }
  return out;
}

v1::RegionOfInterest encode_region(const std::vector<std::int32_t>& vertices) {
  v1::RegionOfInterest out;
  pack(vertices.data(), vertices.size(), *out.mutable_vertices());
  return out;
}

void encode_group(const Handle& handle, v1::Handle& out) {
  if (handle.points.empty()) {
    pack(handle.vertices.data(), handle.vertices.size(), *out.mutable_vertices());
  } else {
    encode_points(handle.points, *out.mutable_points());
  }
  encode_hold(handle.hold, out);
  out.set_footprint_radius(handle.footprint);
}

void encode_motion(const HandleMotion& motion, v1::Motion& out) {
  std::visit(MotionEncoder{out}, motion);
}

void encode_change(const HandleChange& change, v1::HandleUpdate& out) {
  out.set_name(change.name);
  if (const auto* const handle = std::get_if<Handle>(&change.change)) {
    encode_group(*handle, *out.mutable_set());
    encode_motion(handle->motion, *out.mutable_set()->mutable_motion());
  } else if (const auto* const motion = std::get_if<HandleMotion>(&change.change)) {
    encode_motion(*motion, *out.mutable_move());
  } else {
    out.mutable_remove();
  }
}

}  // namespace lpdeform
