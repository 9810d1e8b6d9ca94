#include "server/encode_stored.h"

#include <bit>
#include <string>

#include "server/encode.h"

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

struct HoldEncoder {
  v1::Handle& out;
  void operator()(const Exactly&) const {}
  void operator()(const Soft& soft) const { out.mutable_soft()->set_weight(soft.weight); }
  void operator()(const Orientation& hold) const { out.mutable_orientation()->set_weight(hold.weight); }
  void operator()(const AxisLock& lock) const {
    encode_vector(lock.axis, *out.mutable_axis_lock()->mutable_axis());
  }
  void operator()(const PlaneLock& lock) const {
    encode_vector(lock.normal, *out.mutable_plane_lock()->mutable_normal());
  }
};

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

}  // namespace

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
  std::visit(HoldEncoder{out}, handle.hold);
  out.set_footprint_radius(handle.footprint);
}

void encode_motion(const HandleMotion& motion, v1::Motion& out) {
  std::visit(MotionEncoder{out}, motion);
}

}  // namespace lpdeform
