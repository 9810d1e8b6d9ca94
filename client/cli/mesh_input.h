#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cpp/types.h"
#include "core/energy/weights.h"
#include "core/mesh/io.h"
#include "core/mesh/report.h"

namespace lpdeform::cli {

/// A mesh file that was read, examined, and can be deformed. Errors: as read_mesh and deformable have them.
absl::StatusOr<MeshFile> read_deformable(const std::filesystem::path& path);

/// What a session on a server would report of `mesh`, which need not be fit for one.
MeshReport full_report(const TriangleMesh& mesh, WeightKind weights);

/// For the client library.
client::Mesh to_client(const TriangleMesh& mesh);
client::MeshReport to_client(const MeshReport& report);

std::vector<double> flat(const Points& points);
Points points_of(std::span<const double> numbers);

}  // namespace lpdeform::cli
