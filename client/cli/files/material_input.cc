#include "client/cli/files/material_input.h"

#include <cstdio>
#include <utility>

#include "absl/strings/numbers.h"
#include "client/cli/files/field_file.h"
#include "client/cli/files/mesh_input.h"
#include "client/cli/files/painting.h"
#include "core/analysis/automatic_material.h"
#include "core/analysis/shape_features.h"
#include "core/mesh/weld.h"

namespace lpdeform::cli {
namespace {

absl::Status read_base(const MaterialOptions& options, std::int64_t vertex_count, client::Settings& into) {
  into.p = options.p;
  if (options.automatic) into.p = into.stiffness = client::Automatic{*options.automatic};
  if (options.p_field) {
    auto p = read_field(*options.p_field, vertex_count);
    if (!p.ok()) return p.status();
    into.p = *std::move(p);
  }
  if (options.stiffness_field) {
    auto stiffness = read_field(*options.stiffness_field, vertex_count);
    if (!stiffness.ok()) return stiffness.status();
    into.stiffness = *std::move(stiffness);
  }
  return absl::OkStatus();
}

/// The values to paint over: one, or one per vertex.
absl::StatusOr<std::vector<double>> numbers_of(const client::FieldValue& value, const TriangleMesh& mesh,
                                               const Weld& weld, Field Material::*part) {
  if (const auto* const uniform = std::get_if<double>(&value)) return std::vector<double>{*uniform};
  if (const auto* const numbers = std::get_if<std::vector<double>>(&value)) return *numbers;
  const auto shape = RestShape::create(welded(mesh, weld));
  if (!shape.ok()) return shape.status();
  const auto material = automatic_material(**shape, std::get<client::Automatic>(value).strength);
  if (!material.ok()) return material.status();
  const Field& found = *material.*part;
  const Field field = found.size() == 1 ? found : scattered(found, weld);
  return std::vector<double>(field.begin(), field.end());
}

/// Prints a line if --p auto finds no joints.
absl::Status tell_of_joints(const MaterialOptions& options, const TriangleMesh& mesh, const Weld& weld) {
  if (options.automatic.value_or(0) == 0) return absl::OkStatus();
  auto shape = RestShape::create(welded(mesh, weld));
  if (!shape.ok()) return shape.status();
  if (!has_joints(ShapeFeatures(*std::move(shape)).joint()))
    std::fprintf(stderr, "lpdeform: No joints were found in the mesh: p = 2 everywhere.\n");
  return absl::OkStatus();
}

/// Adds the other copies of each vertex, because a group that names one copy means them all.
void add_copies(const Weld& weld, VertexGroup& group) {
  std::vector<bool> is_named(static_cast<std::size_t>(weld.welded_count()));
  for (const std::uint32_t vertex : group.vertices) is_named[weld.to_welded[vertex]] = true;
  group.vertices.clear();
  for (std::int32_t copy = 0; copy < weld.split_count(); ++copy) {
    if (is_named[weld.to_welded[copy]]) group.vertices.push_back(static_cast<std::uint32_t>(copy));
  }
}

absl::StatusOr<std::vector<Paint>> parse_paints(const std::vector<std::string>& texts) {
  std::vector<Paint> paints;
  for (const std::string& text : texts) {
    auto parsed = parse_paint(text);
    if (!parsed.ok()) return parsed.status();
    paints.push_back(*std::move(parsed));
  }
  return paints;
}

bool paints_anything(const std::vector<VertexGroup>& groups, const MaterialOptions& options) {
  bool paints = !options.p_groups.empty() || !options.stiffness_groups.empty();
  for (const VertexGroup& group : groups) paints = paints || group.p || group.stiffness;
  return paints;
}

}  // namespace

absl::Status read_material(const MaterialOptions& options, const AnyMeshFile& file,
                           std::vector<VertexGroup> groups, std::optional<double> welding,
                           client::Settings& into) {
  const std::int64_t vertex_count = file.mesh.vertices.rows();
  if (absl::Status status = read_base(options, vertex_count, into); !status.ok()) return status;
  for (VertexGroup& group : obj_groups(file.obj_source)) groups.push_back(std::move(group));
  if (file.gltf) {
    for (auto& [name, vertices] : file.gltf->groups()) groups.push_back({name, std::move(vertices), {}, {}});
  }
  const bool paints = paints_anything(groups, options);
  if (!paints && !options.automatic) return absl::OkStatus();

  const absl::StatusOr<Weld> weld = weld_of(file.mesh, welding);
  if (!weld.ok()) return weld.status();
  if (absl::Status status = tell_of_joints(options, file.mesh, *weld); !status.ok()) return status;
  if (!paints) return absl::OkStatus();
  if (welding) {
    for (VertexGroup& group : groups) add_copies(*weld, group);
  }
  const auto p_paints = parse_paints(options.p_groups),
             stiffness_paints = parse_paints(options.stiffness_groups);
  if (!p_paints.ok()) return p_paints.status();
  if (!stiffness_paints.ok()) return stiffness_paints.status();
  auto p = numbers_of(*into.p, file.mesh, *weld, &Material::p);
  auto stiffness = numbers_of(into.stiffness.value_or(1.0), file.mesh, *weld, &Material::stiffness);
  if (!p.ok()) return p.status();
  if (!stiffness.ok()) return stiffness.status();
  PaintedFields fields{*std::move(p), *std::move(stiffness)};
  absl::Status painted = paint(groups, *p_paints, *stiffness_paints, vertex_count, fields);
  if (!painted.ok()) return painted;
  if (fields.p.size() > 1) into.p = std::move(fields.p);
  if (fields.stiffness.size() > 1) into.stiffness = std::move(fields.stiffness);
  return absl::OkStatus();
}

bool parse_p(const std::string& text, MaterialOptions& options) {
  constexpr std::string_view kAuto = "auto";
  double value = 1;
  if (text.starts_with(kAuto)) {
    const std::string rest = text.substr(kAuto.size());
    if (!rest.empty() && !(rest[0] == ':' && absl::SimpleAtod(rest.substr(1), &value))) return false;
    options.automatic = value;
    return value >= 0 && value <= 1;
  }
  options.automatic.reset();
  return absl::SimpleAtod(text, &options.p) && options.p >= 1 && options.p <= 64;
}

}  // namespace lpdeform::cli
