#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "core/analysis/shape_features.h"
#include "core/mesh/mesh.h"
#include "core/mesh/weld.h"
#include "core/solve/deformer.h"
#include "lpdeform/v1/service.pb.h"
#include "server/runtime/upload.h"
#include "server/session/frame_stream.h"
#include "server/session/update.h"

namespace lpdeform {

/// What buffers of a stored session name: bytes by "blobs/KEY".
using StoredBlobs = std::map<std::string, std::string>;

/// Turns messages of the contract into the values of core and session. Numbers from outside are hostile:
/// every size is checked before memory is taken for it, every enum for values that we do not know; however
/// often a message names an upload, no more numbers come out than the mesh has room for. What a value means
/// is checked where it is used. Errors are INVALID_ARGUMENT: INLINE_TOO_LARGE, BUFFER_MISSING, BUFFER_SIZE,
/// ENUM_UNKNOWN, FIELD_MISSING, FIELD_SIZE, POSITIONS_SIZE, HANDLE_CHANGE_MISSING, HANDLE_TOO_MANY_VERTICES,
/// HANDLE_POINT_COUNT, REGION_EMPTY, MOTION_MISSING, NORMALS_SIZE, NORMALS_NOT_FINITE; of numbers over 2^31 - 1, which nothing
/// behind could name, HANDLE_VERTEX_OUT_OF_RANGE, HANDLE_FACE_OUT_OF_RANGE, REGION_VERTEX_OUT_OF_RANGE, ITERATIONS_OUT_OF_RANGE; of
/// uploads what Uploads::find and Upload::bytes have. For one message, one thread.
///
/// What a message leaves to the server to find in the geometry (AutomaticField, Resize) becomes plain fields and
/// handles here, in the client's vertices like all others, so that nothing behind knows of it; also
/// STRENGTH_OUT_OF_RANGE, RESIZE_SCALE_OUT_OF_RANGE, RESIZE_ORIGIN_NOT_FINITE, RESIZE_AXES. The first such
/// message of a session waits for ShapeFeatures.
class Decoder {
 public:
  /// `vertex_count`: of the client's mesh that the message is about; `features`: its geometry, needed by
  /// handles(), settings() and update(); `owner`: whose uploads it may name; `weld`: from the client's vertices to those of `features`, null where
  /// they are the same.
  Decoder(Uploads& uploads, std::uint32_t vertex_count, const ShapeFeatures* features = nullptr,
          const Weld* weld = nullptr, std::string owner = "")
      : uploads_(uploads),
        vertex_count_(vertex_count),
        features_(features),
        weld_(weld),
        owner_(std::move(owner)),
        room_for_vertices_(vertex_count),
        room_for_targets_(vertex_count),
        room_for_region_(vertex_count) {}

  /// The same for messages that were stored: inline bytes of any size, blobs in place of uploads. `blobs` must outlive it.
  Decoder reading_stored(const StoredBlobs& blobs) const;

  /// The bytes of a buffer, where they are: as long as the message, what is returned, and what is stored live.
  struct Bytes {
    std::shared_ptr<const Upload> owner;  // of an upload, so that it does not expire meanwhile
    std::string_view view;
  };
  absl::StatusOr<Bytes> bytes(const v1::Buffer& buffer, std::string_view what);
  /// A copy of them.
  absl::StatusOr<std::string> raw(const v1::Buffer& buffer, std::string_view what);

  /// Also MESH_TOO_LARGE. Does not look at coordinates and indices; a vertex index of a face over 2^31 - 1 becomes
  /// that, and errors name the face.
  struct MeshLimits {
    std::uint32_t most_vertices;
    std::uint32_t most_faces;
  };
  absl::Status check_mesh_size(const v1::Mesh& message, const MeshLimits& limits);
  absl::StatusOr<TriangleMesh> mesh(const v1::Mesh& message);

  absl::StatusOr<Update> update(const v1::Update& message);
  absl::Status handles(const google::protobuf::RepeatedPtrField<v1::HandleUpdate>& messages, Update& out);
  absl::StatusOr<SettingsChange> settings(const v1::SettingsUpdate& message);
  absl::StatusOr<Points> positions(const v1::Positions& message);
  /// No rows where the message is empty.
  absl::StatusOr<Points> normals(const v1::Normals& message);
  /// Null where the message is empty. Also WELD_SIZE, WELD_OUT_OF_RANGE, WELD_TOO_FAR, WELD_TOLERANCE,
  /// WELD_TOO_DENSE.
  absl::StatusOr<std::shared_ptr<const Weld>> weld(const v1::Weld& message, const Points& positions);

 private:
  absl::StatusOr<HandleChange> handle(const v1::HandleUpdate& message);
  absl::StatusOr<Handle> group(const v1::Handle& message, const std::string& name);
  using OutOfRange = std::function<absl::Status(std::uint32_t index)>;
  absl::StatusOr<std::vector<std::int32_t>> indices(const v1::Buffer& buffer, std::string_view what,
                                                    std::uint64_t& room, const OutOfRange& out_of_range);
  absl::StatusOr<std::vector<SurfacePoint>> surface_points(const v1::SurfacePoints& message,
                                                           const std::string& name);
  absl::StatusOr<std::vector<std::int32_t>> region(const v1::RegionOfInterest& message);
  absl::StatusOr<HandleMotion> motion(const v1::Motion& message);
  absl::StatusOr<Field> field(const v1::Field& message, std::string_view what, Field Material::*part);
  absl::Status resize(const v1::Resize& message, Update& out) const;
  Field for_client(Field found) const;
  struct PackedPoints {
    Scalar scalar;
    Bytes bytes;
    std::uint64_t count;
    Points unpack() const;
  };
  absl::StatusOr<PackedPoints> points(v1::Scalar scalar, const v1::Buffer& buffer, std::string_view what);

  absl::Status take_room(std::uint64_t& room, std::uint64_t count, std::string_view what) const;

  Uploads& uploads_;
  const std::uint32_t vertex_count_;
  const ShapeFeatures* const features_;
  const Weld* const weld_;
  const std::string owner_;
  const StoredBlobs* stored_ = nullptr;  // where the messages are stored ones
  std::uint64_t room_for_vertices_;
  std::uint64_t room_for_targets_;
  std::uint64_t room_for_region_;
};

/// CREDIT_OUT_OF_RANGE, FRAME_RATE_OUT_OF_RANGE, ENUM_UNKNOWN.
absl::StatusOr<StreamOptions> decode_frame_options(const v1::FrameOptions& message);
absl::StatusOr<Scalar> decode_scalar(v1::Scalar scalar);
absl::StatusOr<WeightKind> decode_weights(v1::WeightKind weights);
absl::StatusOr<FreeComponents> decode_free_components(v1::FreeComponents free_components);

}  // namespace lpdeform
