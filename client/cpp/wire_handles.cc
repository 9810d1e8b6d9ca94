// Converts changes of handles that the server made to our plain types.

#include <cstring>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cpp/wire.h"
#include "client/cpp/wire_holds.h"
#include "client/cpp/wire_vectors.h"

namespace lpdeform::client {
namespace {

absl::Status wrong_length(const std::string& what) {
  return absl::InternalError(absl::StrCat("The server sent ", what, " of a wrong length."));
}

template <typename Number>
absl::Status unpack(const v1::Buffer& buffer, const std::string& what, std::vector<Number>& out) {
  const std::string& bytes = buffer.inline_();
  if (bytes.size() % sizeof(Number) != 0) return wrong_length(what);
  out.resize(bytes.size() / sizeof(Number));
  if (!out.empty()) std::memcpy(out.data(), bytes.data(), bytes.size());
  return absl::OkStatus();
}

absl::StatusOr<Motion> motion_of(const v1::Motion& message) {
  if (message.has_rigid()) {
    const v1::RigidMotion& rigid = message.rigid();
    return RigidMotion{.axis = numbers_of(rigid.axis()),
                       .angle_radians = rigid.angle_radians(),
                       .center = numbers_of(rigid.center()),
                       .translation = numbers_of(rigid.translation())};
  }
  if (!message.has_targets()) return Fixed{};
  TargetPositions targets;
  absl::Status unpacked = unpack(message.targets().positions(), "target positions", targets.positions);
  if (unpacked.ok() && targets.positions.size() % 3 != 0) unpacked = wrong_length("target positions");
  if (!unpacked.ok()) return unpacked;
  return targets;
}

absl::Status unpack_points(const v1::SurfacePoints& message, std::vector<SurfacePoint>& out) {
  std::vector<std::uint32_t> faces;
  std::vector<double> barycentric;
  absl::Status unpacked = unpack(message.faces(), "faces", faces);
  unpacked.Update(unpack(message.barycentric(), "barycentric coordinates", barycentric));
  if (unpacked.ok() && barycentric.size() != 3 * faces.size())
    unpacked = wrong_length("barycentric coordinates");
  if (!unpacked.ok()) return unpacked;
  for (std::size_t k = 0; k < faces.size(); ++k) {
    out.push_back({.face = faces[k],
                   .barycentric = {barycentric[3 * k], barycentric[3 * k + 1], barycentric[3 * k + 2]}});
  }
  return absl::OkStatus();
}

absl::StatusOr<Handle> handle_of(const v1::Handle& message) {
  Handle handle;
  absl::Status unpacked = unpack(message.vertices(), "vertices", handle.vertices);
  unpacked.Update(unpack_points(message.points(), handle.points));
  auto motion = motion_of(message.motion());
  unpacked.Update(motion.status());
  if (!unpacked.ok()) return unpacked;
  handle.motion = *std::move(motion);
  handle.hold = hold_from_wire(message);
  handle.footprint = message.footprint_radius();
  return handle;
}

}  // namespace

absl::StatusOr<Update> from_wire(const google::protobuf::RepeatedPtrField<v1::HandleUpdate>& changes) {
  Update update;
  for (const v1::HandleUpdate& message : changes) {
    Update::Change& change = update.handles[message.name()];
    if (message.has_set()) {
      auto handle = handle_of(message.set());
      if (!handle.ok()) return handle.status();
      change = *std::move(handle);
    } else if (message.has_move()) {
      auto motion = motion_of(message.move());
      if (!motion.ok()) return motion.status();
      change = *std::move(motion);
    } else {
      change = Update::Removal{};
    }
  }
  return update;
}

}  // namespace lpdeform::client
