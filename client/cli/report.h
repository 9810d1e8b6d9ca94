#pragma once

#include <string>

#include "client/cpp/types.h"

namespace lpdeform::cli {

/// The report's `mesh`, which `lpdeform info --json` prints: vertices, faces, edges, components,
/// boundary_loops, a count for each kind of defect, and `first` with the first few of each kind that occurs.
std::string mesh_json(const client::MeshReport& mesh);

/// The same for people: one number per line, with the first few defects beside their count.
std::string mesh_text(const client::MeshReport& mesh);

/// The report of a deformation as JSON; README.md lists its keys. `p` is a number if it is the same
/// everywhere, otherwise {min, mean, max}.
std::string report_json(const client::MeshReport& mesh, const client::FieldValue& p,
                        const client::SolveResult& result);

}  // namespace lpdeform::cli
