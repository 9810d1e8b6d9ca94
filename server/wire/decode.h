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
#include "server/given/given.h"
#include "server/runtime/upload.h"
#include "server/session/frame_stream.h"
#include "server/session/update.h"

namespace lpdeform {

/// The bytes that buffers of a stored session name, by "blobs/KEY".
using StoredBlobs = std::map<std::string, std::string>;

/// Converts messages of the contract to values of core and session. Input is untrusted: every size is checked
/// before memory is allocated for it, and every enum for unknown values. However often a message names an
/// upload, it yields no more numbers than the mesh has room for. What a value means is checked where it is
/// used. Errors are INVALID_ARGUMENT: INLINE_TOO_LARGE, BUFFER_MISSING, BUFFER_SIZE, ENUM_UNKNOWN,
/// FIELD_MISSING, FIELD_SIZE, POSITIONS_SIZE, HANDLE_CHANGE_MISSING, HANDLE_TOO_MANY_VERTICES,
/// HANDLE_POINT_COUNT, REGION_EMPTY, MOTION_MISSING, NORMALS_SIZE, NORMALS_NOT_FINITE; for indices over 2^31
/// - 1, which later code cannot represent, HANDLE_VERTEX_OUT_OF_RANGE, HANDLE_FACE_OUT_OF_RANGE,
/// REGION_VERTEX_OUT_OF_RANGE, ITERATIONS_OUT_OF_RANGE; for uploads those of Uploads::find and Upload::bytes.
/// For one message and one thread.
///
/// Some fields leave values for the server to find in the geometry (AutomaticField, Resize). Here they become
/// plain fields and handles, in the client's vertices like all others, so later code does not know of them.
/// More errors: STRENGTH_OUT_OF_RANGE, RESIZE_SCALE_OUT_OF_RANGE, RESIZE_ORIGIN_NOT_FINITE, RESIZE_AXES. The
/// first such message of a session waits for ShapeFeatures.
class Decoder {
 public:
  /// `vertex_count`: of the client's mesh. `features`: its geometry, needed by handles(), settings() and
  /// update(). `owner`: whose uploads the message may name. `weld`: from the client's vertices to those of
  /// `features`; null if they are the same.
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

  /// A decoder for stored messages: inline bytes of any size, and blobs instead of uploads. `blobs` must
  /// outlive it.
  Decoder reading_stored(const StoredBlobs& blobs) const;

  /// The bytes of a buffer, without a copy. Valid as long as the message, this value and the stored blobs
  /// live.
  struct Bytes {
    std::shared_ptr<const Upload> owner;  // keeps an upload from expiring meanwhile
    std::string_view view;
  };
  absl::StatusOr<Bytes> bytes(const v1::Buffer& buffer, std::string_view what);
  /// A copy of the bytes of a buffer.
  absl::StatusOr<std::string> raw(const v1::Buffer& buffer, std::string_view what);

  /// More errors: MESH_TOO_LARGE. Does not check coordinates and indices. A vertex index of a face over 2^31
  /// - 1 becomes 2^31 - 1; errors name the face.
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
  /// No rows if the message is empty.
  absl::StatusOr<Points> normals(const v1::Normals& message);
  /// Null if the message is empty. More errors: WELD_SIZE, WELD_OUT_OF_RANGE, WELD_TOO_FAR, WELD_TOLERANCE,
  /// WELD_TOO_DENSE.
  absl::StatusOr<std::shared_ptr<const Weld>> weld(const v1::Weld& message, const Points& positions);

 private:
  absl::StatusOr<HandleChange> handle(const v1::HandleUpdate& message);
  absl::StatusOr<Handle> group(const v1::Handle& message, const std::string& name);
  using OutOfRange = std::function<absl::Status(std::uint32_t index)>;
  absl::StatusOr<std::vector<std::int32_t>> indices(const v1::Buffer& buffer, std::string_view what,
                                                    GivenRoom& room, const OutOfRange& out_of_range);
  absl::StatusOr<std::vector<SurfacePoint>> surface_points(const v1::SurfacePoints& message,
                                                           const std::string& name);
  absl::StatusOr<std::vector<std::int32_t>> region(const v1::RegionOfInterest& message);
  absl::StatusOr<HandleMotion> motion(const v1::Motion& message);
  absl::StatusOr<Field> field(const v1::Field& message, std::string_view what, Field Material::*part);
  absl::Status resize(const v1::Resize& message, Update& out) const;
  struct PackedPoints {
    Scalar scalar;
    Bytes bytes;
    std::uint64_t count;
    Points unpack() const;
  };
  absl::StatusOr<PackedPoints> points(v1::Scalar scalar, const v1::Buffer& buffer, std::string_view what);

  Uploads& uploads_;
  const std::uint32_t vertex_count_;
  const ShapeFeatures* const features_;
  const Weld* const weld_;
  const std::string owner_;
  const StoredBlobs* stored_ = nullptr;  // set for stored messages
  GivenRoom room_for_vertices_;
  GivenRoom room_for_targets_;
  GivenRoom room_for_region_;
};

/// CREDIT_OUT_OF_RANGE, FRAME_RATE_OUT_OF_RANGE, ENUM_UNKNOWN.
absl::StatusOr<StreamOptions> decode_frame_options(const v1::FrameOptions& message);
absl::StatusOr<Scalar> decode_scalar(v1::Scalar scalar);
absl::StatusOr<WeightKind> decode_weights(v1::WeightKind weights);
absl::StatusOr<FreeComponents> decode_free_components(v1::FreeComponents free_components);

}  // namespace lpdeform
