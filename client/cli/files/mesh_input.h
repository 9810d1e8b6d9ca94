#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cpp/types.h"
#include "core/energy/weights.h"
#include "core/gltf/any_mesh.h"
#include "core/mesh/report.h"
#include "core/mesh/weld.h"

namespace lpdeform::cli {

/// The same error, with a text that begins with its subject, a file or an option, unless the text names it
/// already.
absl::Status said_of(const std::string& what, const absl::Status& error);

/// As read_any_mesh; errors name the file.
absl::StatusOr<AnyMeshFile> read_mesh_file(const std::filesystem::path& path);

/// Reads and checks a mesh file that must be fit for deformation. Errors: those of read_any_mesh and deformable.
absl::StatusOr<AnyMeshFile> read_deformable(const std::filesystem::path& path);

/// Whether vertices are welded, and how: with the tolerance that was asked for; else, unless `is_off`, with the
/// default tolerance (0) if the file is one whose format splits vertices, as glTF does.
std::optional<double> welding(const AnyMeshFile& file, std::optional<double> asked, bool is_off);

/// Prints to stderr what of a glTF is not deformed, one line each.
void print_left(const AnyMeshFile& file);

/// What a session on a server would report of `mesh`. The mesh need not be fit for deformation.
MeshReport full_report(const TriangleMesh& mesh, WeightKind weights);

/// Welds by position with this tolerance (0: the default); not set: no weld.
absl::StatusOr<Weld> weld_of(const TriangleMesh& mesh, std::optional<double> tolerance);
client::Weld by_position(std::optional<double> tolerance);

/// Prints the report's notices to stderr, one per line.
void print_notices(const client::MeshReport& report);

/// For the client library.
client::Mesh to_client(const TriangleMesh& mesh);
client::MeshReport to_client(const MeshReport& report);

std::vector<double> flat(const Points& points);
Points points_of(std::span<const double> numbers);

}  // namespace lpdeform::cli
