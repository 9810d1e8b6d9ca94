#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cpp/types.h"
#include "core/energy/weights.h"
#include "core/io/mesh_io.h"
#include "core/mesh/report.h"
#include "core/mesh/weld.h"

namespace lpdeform::cli {

/// The same error, whose text begins with what it is about, a file or an option, unless it names that already.
absl::Status said_of(const std::string& what, const absl::Status& error);

/// As read_mesh; errors name the file.
absl::StatusOr<MeshFile> read_mesh_file(const std::filesystem::path& path);

/// A mesh file that was read, examined, and can be deformed. Errors: as read_mesh and deformable have them.
absl::StatusOr<MeshFile> read_deformable(const std::filesystem::path& path);

/// What a session on a server would report of `mesh`, which need not be fit for one.
MeshReport full_report(const TriangleMesh& mesh, WeightKind weights);

/// By position with this tolerance (0: the default), or none.
absl::StatusOr<Weld> weld_of(const TriangleMesh& mesh, std::optional<double> tolerance);
client::Weld by_position(std::optional<double> tolerance);

/// What the report's owner should know, a line each on stderr.
void print_notices(const client::MeshReport& report);

/// For the client library.
client::Mesh to_client(const TriangleMesh& mesh);
client::MeshReport to_client(const MeshReport& report);

std::vector<double> flat(const Points& points);
Points points_of(std::span<const double> numbers);

}  // namespace lpdeform::cli
