#include "server/decode.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/analysis/automatic_material.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/solve/resize.h"

namespace lpdeform {
namespace {

constexpr std::size_t kMostInlineBytes = 1u << 20;

absl::Status unknown_enum(std::string_view what, int value) {
  return invalid_input({"ENUM_UNKNOWN", std::string(what), ""},
                       absl::StrCat("The server does not know ", std::string(what), " ", value, "."));
}

absl::StatusOr<Format> decode_encoding(v1::Encoding encoding, Format unspecified, Format raw) {
  switch (encoding) {
    case v1::ENCODING_UNSPECIFIED:
      return unspecified;
    case v1::ENCODING_RAW:
      return raw;
    case v1::ENCODING_QUANTIZED:
      return Format::kQuantized;
    case v1::ENCODING_COMPRESSED:
      return Format::kCompressed;
    default:
      return unknown_enum("encoding", encoding);
  }
}

absl::Status wrong_size(std::string_view what, std::uint64_t is, const std::string& should) {
  return invalid_input({"BUFFER_SIZE", std::string(what), should},
                       absl::StrCat("The ", std::string(what), " have ", is, " bytes, not ", should, "."));
}

/// Numbers of type Wire, packed, as a row-major matrix of doubles with `columns` columns.
template <typename Wire, typename Result>
void unpack(std::string_view bytes, Result& out) {
  for (Eigen::Index k = 0; k < out.size(); ++k) {
    Wire number;
    std::memcpy(&number, bytes.data() + static_cast<std::size_t>(k) * sizeof(Wire), sizeof(Wire));
    out.data()[k] = number;
  }
}

template <typename Result>
void unpack(Scalar scalar, std::string_view bytes, Result& out) {
  if (scalar == Scalar::kFloat64) {
    unpack<double>(bytes, out);
  } else {
    unpack<float>(bytes, out);
  }
}

/// Vertex indices; what does not fit becomes the largest that does, which no mesh has.
template <typename Out>
void unpack_indices(std::string_view bytes, std::size_t count, Out* out) {
  for (std::size_t k = 0; k < count; ++k) {
    std::uint32_t index;
    std::memcpy(&index, bytes.data() + k * sizeof(index), sizeof(index));
    out[k] = static_cast<std::int32_t>(
        std::min<std::uint32_t>(index, static_cast<std::uint32_t>(std::numeric_limits<std::int32_t>::max())));
  }
}

absl::StatusOr<Method> decode_method(v1::Method method) {
  switch (method) {
    case v1::METHOD_UNSPECIFIED:
      return Method::kAuto;
    case v1::METHOD_QUASI_NEWTON:
      return Method::kQuasiNewton;
    case v1::METHOD_LINE_SEARCH:
      return Method::kLineSearch;
    case v1::METHOD_LOCAL_GLOBAL:
      return Method::kLocalGlobal;
    case v1::METHOD_CONIC:
      return Method::kConic;
    case v1::METHOD_MULTIRESOLUTION:
      return Method::kMultiresolution;
    default:
      return unknown_enum("method", method);
  }
}

absl::StatusOr<InitialGuess> decode_initial(v1::InitialGuess initial) {
  switch (initial) {
    case v1::INITIAL_GUESS_UNSPECIFIED:
      return InitialGuess::kCurrent;
    case v1::INITIAL_GUESS_LAPLACIAN:
      return InitialGuess::kLaplacian;
    case v1::INITIAL_GUESS_REST:
      return InitialGuess::kRest;
    default:
      return unknown_enum("initial guess", initial);
  }
}

absl::StatusOr<SolveSettings> decode_solver(const v1::SolverSettings& message) {
  const auto method = decode_method(message.method());
  if (!method.ok()) return method.status();
  const auto initial = decode_initial(message.initial());
  if (!initial.ok()) return initial.status();
  SolveSettings settings;
  settings.method = *method;
  settings.initial = *initial;
  if (message.tolerance() != 0) settings.tolerance = message.tolerance();
  if (message.time_limit_seconds() != 0) settings.time_limit_seconds = message.time_limit_seconds();
  if (message.max_iterations() != 0) {
    const bool fits = message.max_iterations() <= static_cast<std::uint32_t>(std::numeric_limits<int>::max());
    settings.max_iterations =
        fits ? static_cast<int>(message.max_iterations()) : -1;  // refused with a better text
  }
  return settings;
}

Eigen::Vector3d decode_vector(const v1::Vector3& message) {
  return {message.x(), message.y(), message.z()};
}

Hold decode_hold(const v1::Handle& message) {
  switch (message.hold_case()) {
    case v1::Handle::kSoft:
      return message.soft().has_weight() ? Soft{message.soft().weight()} : Soft{};
    case v1::Handle::kOrientation:
      return message.orientation().has_weight() ? Orientation{message.orientation().weight()} : Orientation{};
    case v1::Handle::kAxisLock:
      return AxisLock{decode_vector(message.axis_lock().axis())};
    case v1::Handle::kPlaneLock:
      return PlaneLock{decode_vector(message.plane_lock().normal())};
    case v1::Handle::HOLD_NOT_SET:
      break;
  }
  return Exactly{};
}

std::uint64_t mesh_bytes(const v1::Mesh& message, Scalar scalar) {
  return std::uint64_t{message.vertex_count()} * 3 * bytes_of(scalar) +
         std::uint64_t{message.face_count()} * 12;
}

}  // namespace

absl::StatusOr<Scalar> decode_scalar(v1::Scalar scalar) {
  switch (scalar) {
    case v1::SCALAR_UNSPECIFIED:
    case v1::SCALAR_FLOAT32:
      return Scalar::kFloat32;
    case v1::SCALAR_FLOAT64:
      return Scalar::kFloat64;
    default:
      return unknown_enum("scalar", scalar);
  }
}

absl::StatusOr<WeightKind> decode_weights(v1::WeightKind weights) {
  switch (weights) {
    case v1::WEIGHT_KIND_UNSPECIFIED:
    case v1::WEIGHT_KIND_COTANGENT:
      return WeightKind::kCotangent;
    case v1::WEIGHT_KIND_UNIFORM:
      return WeightKind::kUniform;
    case v1::WEIGHT_KIND_INTRINSIC_DELAUNAY:
      return WeightKind::kIntrinsicDelaunay;
    default:
      return unknown_enum("weight kind", weights);
  }
}

absl::StatusOr<FreeComponents> decode_free_components(v1::FreeComponents free_components) {
  switch (free_components) {
    case v1::FREE_COMPONENTS_UNSPECIFIED:
    case v1::FREE_COMPONENTS_ERROR:
      return FreeComponents::kError;
    case v1::FREE_COMPONENTS_STAY:
      return FreeComponents::kStay;
    case v1::FREE_COMPONENTS_FOLLOW:
      return FreeComponents::kFollow;
    default:
      return unknown_enum("treatment of free components", free_components);
  }
}

absl::StatusOr<StreamOptions> decode_frame_options(const v1::FrameOptions& message) {
  const auto scalar = decode_scalar(message.scalar());
  if (!scalar.ok()) return scalar.status();
  const auto encoding = decode_encoding(message.encoding(), format_of(*scalar), format_of(*scalar));
  if (!encoding.ok()) return encoding.status();
  const auto lowest = decode_encoding(message.lowest_encoding(), *encoding, Format::kFloat32);
  if (!lowest.ok()) return lowest.status();
  StreamOptions options;
  options.format = *encoding;
  options.lowest_format = std::max(*encoding, *lowest);
  options.with_distortion = !message.without_distortion();
  options.with_normals = message.with_normals();
  if (message.credit() > StreamOptions::kMostCredit) {
    return invalid_input(
        {"CREDIT_OUT_OF_RANGE", "credit", absl::StrCat("credit <= ", StreamOptions::kMostCredit)},
        absl::StrCat("A credit of ", message.credit(), " is over ", StreamOptions::kMostCredit, "."));
  }
  if (message.credit() != 0) options.credit = message.credit();
  if (!(message.max_frames_per_second() >= 0) || std::isinf(message.max_frames_per_second())) {
    return invalid_input(
        {"FRAME_RATE_OUT_OF_RANGE", "max_frames_per_second", "finite and >= 0"},
        absl::StrCat("The frame rate is ", message.max_frames_per_second(), ", not finite and >= 0."));
  }
  options.max_frames_per_second = message.max_frames_per_second();
  return options;
}

absl::StatusOr<Decoder::Bytes> Decoder::bytes(const v1::Buffer& buffer, std::string_view what) {
  if (buffer.has_inline_()) {
    if (buffer.inline_().size() <= kMostInlineBytes) return Bytes{nullptr, buffer.inline_()};
    return invalid_input({"INLINE_TOO_LARGE", std::string(what), absl::StrCat(kMostInlineBytes, " bytes")},
                         absl::StrCat("The ", std::string(what), " have ", buffer.inline_().size(),
                                      " bytes inline, over ", kMostInlineBytes, "; upload them."));
  }
  if (!buffer.has_upload()) {
    return invalid_input({"BUFFER_MISSING", std::string(what), ""},
                         absl::StrCat("The ", std::string(what), " are missing."));
  }
  const auto upload = uploads_.find(buffer.upload());
  if (!upload.ok()) return upload.status();
  const auto whole = (*upload)->bytes();
  if (!whole.ok()) return whole.status();
  return Bytes{*upload, *whole};
}

absl::Status Decoder::check_mesh_size(const v1::Mesh& message, const MeshLimits& limits) {
  if (message.vertex_count() > limits.most_vertices || message.face_count() > limits.most_faces) {
    const std::string limit =
        absl::StrCat("vertices <= ", limits.most_vertices, ", faces <= ", limits.most_faces);
    return invalid_input({"MESH_TOO_LARGE", "mesh", limit},
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
  return invalid_input(
      {"POSITIONS_SIZE", "positions", absl::StrCat(vertex_count_, " positions")},
      absl::StrCat("There are ", packed->count, " positions for ", vertex_count_, " vertices."));
}

absl::StatusOr<Points> Decoder::normals(const v1::Normals& message) {
  if (!message.has_data()) return Points(0, 3);
  const auto packed = points(message.scalar(), message.data(), "normals");
  if (!packed.ok()) return packed.status();
  if (packed->count != vertex_count_) {
    return invalid_input(
        {"NORMALS_SIZE", "normals", absl::StrCat(vertex_count_, " normals")},
        absl::StrCat("There are ", packed->count, " normals for ", vertex_count_, " vertices."));
  }
  Points normals = packed->unpack();
  for (Eigen::Index v = 0; v < normals.rows(); ++v) {
    if (normals.row(v).allFinite()) continue;
    return invalid_input({"NORMALS_NOT_FINITE", absl::StrCat("vertex ", v), "finite numbers"},
                         absl::StrCat("The normal of vertex ", v, " has a NaN or infinite number."));
  }
  return normals;
}

absl::StatusOr<std::shared_ptr<const Weld>> Decoder::weld(const v1::Weld& message, const Points& positions) {
  if (message.by_case() == v1::Weld::BY_NOT_SET) return nullptr;
  if (message.has_position()) return std::make_shared<const Weld>(weld_by_position(positions));
  const auto data = bytes(message.groups(), "weld groups");
  if (!data.ok()) return data.status();
  if (data->view.size() % sizeof(std::uint32_t) != 0)
    return wrong_size("weld groups", data->view.size(), "a multiple of 4");
  std::vector<std::uint32_t> groups(data->view.size() / sizeof(std::uint32_t));
  unpack_indices(data->view, groups.size(), groups.data());
  auto weld = weld_by_groups(positions, groups);
  if (!weld.ok()) return weld.status();
  return std::make_shared<const Weld>(*std::move(weld));
}

absl::Status Decoder::take_room(std::uint64_t& room, std::uint64_t count, std::string_view what) const {
  if (count <= room) {
    room -= count;
    return absl::OkStatus();
  }
  return invalid_input(
      {"HANDLE_TOO_MANY_VERTICES", std::string(what), absl::StrCat(vertex_count_, " in all")},
      absl::StrCat("The update has more ", std::string(what), " than the mesh's ", vertex_count_,
                   " vertices."));
}

/// A field found on the welded shape, by the client's vertices.
Field Decoder::for_client(Field found) const {
  return weld_ == nullptr || found.size() == 1 ? std::move(found) : scattered(found, *weld_);
}

absl::StatusOr<Field> Decoder::field(const v1::Field& message, std::string_view what, Field Material::*part) {
  if (message.value_case() == v1::Field::kUniform) return Field(Field::Constant(1, message.uniform()));
  if (message.value_case() == v1::Field::kAutomatic) {
    const double strength = message.automatic().strength();
    if (absl::Status status = check_strength(strength); !status.ok()) return status;
    LPDEFORM_CHECK(features_ != nullptr);
    const auto material = automatic_material(features_->joint(), strength);
    return for_client(*material.*part);
  }
  if (message.value_case() != v1::Field::kPerVertex) {
    return invalid_input({"FIELD_MISSING", std::string(what), ""},
                         absl::StrCat("The ", std::string(what), " has no value."));
  }
  const auto scalar = decode_scalar(message.per_vertex().scalar());
  if (!scalar.ok()) return scalar.status();
  const auto data = bytes(message.per_vertex().values(), what);
  if (!data.ok()) return data.status();
  if (data->view.size() % bytes_of(*scalar) != 0) {
    return wrong_size(what, data->view.size(), absl::StrCat("a multiple of ", bytes_of(*scalar)));
  }
  const std::size_t count = data->view.size() / bytes_of(*scalar);
  if (count != 1 && count != vertex_count_) {
    return invalid_input({"FIELD_SIZE", std::string(what), absl::StrCat("1 or ", vertex_count_, " values")},
                         absl::StrCat("The field ", std::string(what), " has ", count, " values for ",
                                      vertex_count_, " vertices."));
  }
  Field field(static_cast<Eigen::Index>(count));
  unpack(*scalar, data->view, field);
  return field;
}

absl::StatusOr<HandleMotion> Decoder::motion(const v1::Motion& message) {
  if (message.has_fixed()) return Fixed{};
  if (message.has_rigid()) {
    const v1::RigidMotion& rigid = message.rigid();
    return RigidMotion{decode_vector(rigid.axis()), rigid.angle_radians(), decode_vector(rigid.center()),
                       decode_vector(rigid.translation())};
  }
  if (!message.has_targets()) {
    return invalid_input({"MOTION_MISSING", "motion", ""},
                         "A motion says neither fixed nor rigid nor targets.");
  }
  const auto targets = points(message.targets().scalar(), message.targets().positions(), "target positions");
  if (!targets.ok()) return targets.status();
  if (absl::Status status = take_room(room_for_targets_, targets->count, "target positions"); !status.ok())
    return status;
  return TargetPositions{targets->unpack()};
}

absl::StatusOr<std::vector<std::int32_t>> Decoder::indices(const v1::Buffer& buffer, std::string_view what,
                                                           std::uint64_t& room) {
  const auto data = bytes(buffer, what);
  if (!data.ok()) return data.status();
  if (data->view.size() % sizeof(std::uint32_t) != 0) {
    return wrong_size(what, data->view.size(), "a multiple of 4");
  }
  const std::size_t count = data->view.size() / sizeof(std::uint32_t);
  if (absl::Status status = take_room(room, count, what); !status.ok()) return status;
  std::vector<std::int32_t> result(count);
  unpack_indices(data->view, count, result.data());
  return result;
}

absl::StatusOr<std::vector<SurfacePoint>> Decoder::surface_points(const v1::SurfacePoints& message) {
  const auto faces = indices(message.faces(), "handle points", room_for_vertices_);
  if (!faces.ok()) return faces.status();
  const auto coordinates = points(message.scalar(), message.barycentric(), "barycentric coordinates");
  if (!coordinates.ok()) return coordinates.status();
  if (coordinates->count != faces->size()) {
    return invalid_input({"HANDLE_POINT_COUNT", "barycentric", absl::StrCat(3 * faces->size(), " numbers")},
                         absl::StrCat("There are ", 3 * coordinates->count, " barycentric coordinates for ",
                                      faces->size(), " points; each takes three."));
  }
  const Points barycentric = coordinates->unpack();
  std::vector<SurfacePoint> result(faces->size());
  for (std::size_t k = 0; k < result.size(); ++k) {
    result[k] = {(*faces)[k], barycentric.row(static_cast<Eigen::Index>(k)).transpose()};
  }
  return result;
}

absl::StatusOr<std::vector<std::int32_t>> Decoder::region(const v1::RegionOfInterest& message) {
  if (!message.has_vertices()) return std::vector<std::int32_t>{};
  auto vertices = indices(message.vertices(), "region vertices", room_for_region_);
  if (!vertices.ok() || !vertices->empty()) return vertices;
  return invalid_input({"REGION_EMPTY", "region", "at least 1 vertex"},
                       "The region of interest has no vertex; nothing could move.");
}

absl::StatusOr<Handle> Decoder::group(const v1::Handle& message) {
  Handle handle;
  if (message.has_vertices() || !message.has_points()) {
    auto vertices = indices(message.vertices(), "handle vertices", room_for_vertices_);
    if (!vertices.ok()) return vertices.status();
    handle.vertices = *std::move(vertices);
  }
  if (message.has_points()) {
    auto points = surface_points(message.points());
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
    return invalid_input({"HANDLE_CHANGE_MISSING", "handles", ""},
                         "A change of a handle says neither set nor move nor remove.");
  }
  auto handle = group(message.set());
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

absl::StatusOr<SettingsChange> Decoder::settings(const v1::SettingsUpdate& message) {
  SettingsChange change;
  if (message.has_p()) {
    auto p = field(message.p(), "p", &Material::p);
    if (!p.ok()) return p.status();
    change.p = *std::move(p);
  }
  if (message.has_stiffness()) {
    auto stiffness = field(message.stiffness(), "stiffness", &Material::stiffness);
    if (!stiffness.ok()) return stiffness.status();
    change.stiffness = *std::move(stiffness);
  }
  if (message.has_length_unit()) change.length_unit = message.length_unit().length();
  if (message.has_solver()) {
    const auto solver = decode_solver(message.solver());
    if (!solver.ok()) return solver.status();
    change.solver = *solver;
  }
  if (message.has_region()) {
    auto vertices = region(message.region());
    if (!vertices.ok()) return vertices.status();
    change.region = *std::move(vertices);
  }
  return change;
}

absl::Status Decoder::resize(const v1::Resize& message, Update& out) const {
  LPDEFORM_CHECK(features_ != nullptr);
  Scaling scaling;
  scaling.scale = decode_vector(message.scale());
  scaling.origin = message.has_origin() ? decode_vector(message.origin()) : box_middle(features_->shape());
  if (message.has_x_axis() || message.has_y_axis()) {
    const auto axes = axes_of(decode_vector(message.x_axis()), decode_vector(message.y_axis()));
    if (!axes.ok()) return axes.status();
    scaling.axes = *axes;
  }
  auto inputs = resize_inputs(*features_, scaling);
  if (!inputs.ok()) return inputs.status();
  if (weld_ != nullptr) {
    for (std::int32_t& vertex : inputs->handle.vertices)
      vertex = weld_->first_copy[vertex];  // holds all copies
  }
  out.handles.push_back({"resize", std::move(inputs->handle)});
  if (!out.settings.p) out.settings.p = for_client(std::move(inputs->material.p));
  if (!out.settings.stiffness) out.settings.stiffness = for_client(std::move(inputs->material.stiffness));
  return absl::OkStatus();
}

absl::StatusOr<Update> Decoder::update(const v1::Update& message) {
  Update update;
  update.input_seq = message.input_seq();
  if (absl::Status status = handles(message.handles(), update); !status.ok()) return status;
  auto change = settings(message.settings());
  if (!change.ok()) return change.status();
  update.settings = *std::move(change);
  if (message.has_resize()) {
    if (absl::Status status = resize(message.resize(), update); !status.ok()) return status;
  }
  return update;
}

}  // namespace lpdeform
