// From values of Python to values of sessions.

#include "client/python/native/values.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/base/fault.h"
#include "core/mesh/weld.h"
#include "server/runtime/refusals.h"

namespace lpdeform::python {
namespace {

constexpr std::uint32_t kMostIndex = std::numeric_limits<std::int32_t>::max();

std::string kind_of(nb::handle value) {
  return nb::cast<std::string>(value.type().attr("__name__"));
}

double number(nb::handle owner, const char* name) {
  return nb::cast<double>(owner.attr(name));
}

Eigen::Vector3d vector(nb::handle values) {
  return {nb::cast<double>(values[0]), nb::cast<double>(values[1]), nb::cast<double>(values[2])};
}

/// What one update gives, and how much more it may give.
struct Giving {
  std::uint32_t vertex_count;
  const ShapeFeatures& features;
  const Weld* weld;
  GivenRoom vertices{vertex_count}, targets{vertex_count}, region{vertex_count};
};

template <typename OutOfRange>
std::vector<std::int32_t> indices(nb::handle values, std::string_view what, GivenRoom& room,
                                  const OutOfRange& out_of_range) {
  const auto given = nb::cast<Indices>(values);
  require(room.take(given.size(), what));
  std::vector<std::int32_t> result(given.size());
  for (std::size_t k = 0; k < result.size(); ++k) {
    if (given.data()[k] > kMostIndex) require(out_of_range(given.data()[k]));
    result[k] = static_cast<std::int32_t>(given.data()[k]);
  }
  return result;
}

HandleMotion motion(nb::handle value, Giving& giving) {
  const std::string kind = kind_of(value);
  if (kind == "RigidMotion") {
    return RigidMotion{vector(value.attr("axis")), number(value, "angle"), vector(value.attr("center")),
                       vector(value.attr("translation"))};
  }
  if (kind != "Targets") return Fixed{};
  const auto positions = nb::cast<Numbers3>(value.attr("positions"));
  require(giving.targets.take(positions.shape(0), "target positions"));
  return TargetPositions{points_of(positions)};
}

Hold hold(nb::handle value) {
  const std::string kind = kind_of(value);
  if (kind == "Soft") return Soft{number(value, "weight")};
  if (kind == "Orientation") return Orientation{number(value, "weight")};
  if (kind == "AxisLock") return AxisLock{vector(value.attr("axis"))};
  if (kind == "PlaneLock") return PlaneLock{vector(value.attr("normal"))};
  if (kind == "Exact") return Exactly{};
  throw nb::type_error(("There is no hold " + kind + " in this process.").c_str());
}

std::vector<SurfacePoint> surface_points(nb::handle value, const std::string& name, Giving& giving) {
  const auto faces = indices(value.attr("faces"), "handle points", giving.vertices, [&](std::uint32_t face) {
    return handle_face_out_of_range(name, face, giving.features.shape().face_count());
  });
  const auto barycentric = nb::cast<Numbers3>(value.attr("barycentric"));
  require(check_point_count(3 * barycentric.shape(0), faces.size()));
  std::vector<SurfacePoint> result(faces.size());
  for (std::size_t k = 0; k < result.size(); ++k) {
    result[k] = {faces[k], Eigen::Map<const Eigen::Vector3d>(barycentric.data() + 3 * k)};
  }
  return result;
}

Handle handle_of(nb::handle value, const std::string& name, Giving& giving) {
  Handle handle;
  handle.vertices = indices(
      value.attr("vertices"), "handle vertices", giving.vertices,
      [&](std::uint32_t vertex) { return handle_vertex_out_of_range(name, vertex, giving.vertex_count); });
  if (!value.attr("points").is_none()) handle.points = surface_points(value.attr("points"), name, giving);
  handle.motion = motion(value.attr("motion"), giving);
  handle.hold = hold(value.attr("hold"));
  handle.footprint = number(value, "footprint");
  return handle;
}

HandleChange change_of(const std::string& name, nb::handle value, Giving& giving) {
  const std::string kind = kind_of(value);
  if (kind == "Removal") return {name, Removal{}};
  if (kind == "Handle") return {name, handle_of(value, name, giving)};
  return {name, motion(value, giving)};
}

std::optional<Field> field(nb::handle value, std::string_view what, Field Material::*part,
                           const Giving& giving) {
  if (value.is_none()) return std::nullopt;
  if (kind_of(value) == "Automatic") {
    const double strength = number(value, "strength");
    const nb::gil_scoped_release released;
    return required(automatic_field(giving.features, giving.weld, strength, part));
  }
  if (nb::isinstance<nb::float_>(value)) return Field(Field::Constant(1, nb::cast<double>(value)));
  const auto given = nb::cast<nb::ndarray<const double, nb::shape<-1>, nb::c_contig, nb::device::cpu>>(value);
  require(check_field_size(what, given.size(), giving.vertex_count));
  return Field(Eigen::Map<const Field>(given.data(), static_cast<Eigen::Index>(given.size())));
}

SolveSettings solver_of(nb::handle value) {
  SolveSettings settings;
  const auto name = nb::cast<std::string>(value.attr("method"));
  const std::optional<Method> method = method_named(name);
  if (!method && name != "auto")
    throw nb::type_error(("There is no method " + name + " in this process.").c_str());
  settings.method = method.value_or(Method::kAuto);
  const auto initial = nb::cast<std::string>(value.attr("initial"));
  settings.initial = initial == "laplacian" ? InitialGuess::kLaplacian
                     : initial == "rest"    ? InitialGuess::kRest
                                            : InitialGuess::kCurrent;
  const nb::object search = value.attr("search");
  if (!search.is_none()) {
    if (const nb::object effort = search.attr("effort"); !effort.is_none())
      settings.effort = required(given_effort(nb::cast<std::uint32_t>(effort)));
    settings.standing.shows = nb::cast<bool>(search.attr("show"));
    if (const double share = number(search, "least_share"); share != 0) settings.standing.least_share = share;
  }
  if (const double tolerance = number(value, "tolerance"); tolerance != 0) settings.tolerance = tolerance;
  if (const double limit = number(value, "time_limit"); limit != 0) settings.time_limit_seconds = limit;
  const int iterations = required(given_iterations(nb::cast<std::uint32_t>(value.attr("max_iterations"))));
  if (iterations != 0) settings.max_iterations = iterations;
  return settings;
}

SettingsChange settings_given(nb::handle settings, Giving& giving) {
  SettingsChange change;
  change.p = field(settings.attr("p"), "p", &Material::p, giving);
  change.stiffness = field(settings.attr("stiffness"), "stiffness", &Material::stiffness, giving);
  if (const nb::object unit = settings.attr("length_unit"); !unit.is_none())
    change.length_unit = nb::cast<double>(unit);
  if (const nb::object solver = settings.attr("solver"); !solver.is_none()) change.solver = solver_of(solver);
  if (const nb::object region = settings.attr("region"); !region.is_none()) {
    change.region = indices(region, "region vertices", giving.region, [&](std::uint32_t vertex) {
      return region_vertex_out_of_range(vertex, giving.vertex_count);
    });
  }
  return change;
}

GivenResize resize_of(nb::handle value) {
  GivenResize resize{vector(value.attr("scale"))};
  if (const nb::object origin = value.attr("origin"); !origin.is_none()) resize.origin = vector(origin);
  if (const nb::object axes = value.attr("axes"); !axes.is_none())
    resize.axes.emplace(vector(axes[0]), vector(axes[1]));
  return resize;
}

Format format_named(std::string_view name) {
  if (name == "float64") return Format::kFloat64;
  return name == "float32" ? Format::kFloat32
                           : Format::kQuantized;  // within a process there is nothing to compress for
}

/// A message may name a file, whose name is any bytes.
nb::str text_of(std::string_view text) {
  return nb::steal<nb::str>(
      PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace"));
}

}  // namespace

nb::object error_of(const absl::Status& status) {
  const Fault fault = fault_of(status);
  return nb::module_::import_("lpdeform.errors")
      .attr("from_status")(static_cast<int>(status.code()),
                           text_of({status.message().data(), status.message().size()}), text_of(fault.reason),
                           text_of(fault.element), text_of(fault.limit), retry_after_ms(status));
}

Points points_of(const Numbers3& numbers) {
  return Eigen::Map<const Points>(numbers.data(), static_cast<Eigen::Index>(numbers.shape(0)), 3);
}

TriangleMesh mesh_of(const Numbers3& vertices, const Indices3& faces) {
  TriangleMesh mesh{points_of(vertices), Faces(static_cast<Eigen::Index>(faces.shape(0)), 3)};
  std::transform(faces.data(), faces.data() + faces.size(), mesh.faces.data(),
                 [](std::uint32_t index) { return static_cast<std::int32_t>(std::min(index, kMostIndex)); });
  return mesh;
}

std::shared_ptr<const Weld> weld_of(nb::handle weld, const Points& positions) {
  if (weld.is_none()) return nullptr;
  if (nb::isinstance<nb::float_>(weld))
    return std::make_shared<const Weld>(required(weld_by_position(positions, nb::cast<double>(weld))));
  const auto given = nb::cast<Indices>(weld);
  const std::vector<std::uint32_t> groups(given.data(), given.data() + given.size());
  return std::make_shared<const Weld>(required(weld_by_groups(positions, groups)));
}

WeightKind weights_of(std::string_view name) {
  if (name == "uniform") return WeightKind::kUniform;
  return name == "intrinsic_delaunay" ? WeightKind::kIntrinsicDelaunay : WeightKind::kCotangent;
}

FreeComponents free_components_of(std::string_view name) {
  if (name == "stay") return FreeComponents::kStay;
  return name == "follow" ? FreeComponents::kFollow : FreeComponents::kError;
}

Update update_of(nb::handle given, std::uint64_t input_seq, const Session& session) {
  Giving giving{session.vertex_count(), session.features(), session.mesh().weld().get()};
  Update update;
  update.input_seq = input_seq;
  update.begins_step = nb::cast<bool>(given.attr("begins_step"));
  for (const auto& [name, change] : nb::cast<nb::dict>(given.attr("handles"))) {
    update.handles.push_back(change_of(nb::cast<std::string>(name), change, giving));
  }
  update.settings = settings_given(given.attr("settings"), giving);
  if (const nb::object value = given.attr("resize"); !value.is_none()) {
    const GivenResize resize = resize_of(value);
    const nb::gil_scoped_release released;
    require(add_resize(giving.features, giving.weld, resize, update));
  }
  return update;
}

SettingsChange settings_of(nb::handle settings, std::uint32_t vertex_count, const ShapeFeatures& features,
                           const Weld* weld) {
  Giving giving{vertex_count, features, weld};
  return settings_given(settings, giving);
}

StreamOptions stream_options_of(nb::handle options) {
  StreamOptions out;
  out.format = format_named(nb::cast<std::string>(options.attr("encoding")));
  out.lowest_format = out.format;
  out.with_distortion = nb::cast<bool>(options.attr("with_distortion"));
  out.with_normals = nb::cast<bool>(options.attr("with_normals"));
  out.with_certificate = nb::cast<bool>(options.attr("certify"));
  if (const auto credit = nb::cast<std::uint32_t>(options.attr("credit")); credit != 0) out.credit = credit;
  out.max_frames_per_second = number(options, "max_frames_per_second");
  require(check_stream_options(out));
  return out;
}

}  // namespace lpdeform::python
