#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/exit_status.h"
#include "client/cli/files/material_input.h"
#include "client/cli/files/outputs.h"
#include "client/cli/server_access.h"
#include "client/cpp/types.h"

namespace lpdeform::cli {

struct DeformOptions {
  std::filesystem::path mesh;
  std::filesystem::path handles;
  MaterialOptions material;
  double length_unit = 0;  // 0: the mean rest edge length
  client::Method method = client::Method::kAuto;
  client::WeightKind weights = client::WeightKind::kCotangent;
  std::string initial = "laplacian";  // or "rest", or a mesh file
  client::FreeComponents free_components = client::FreeComponents::kError;
  std::optional<std::uint32_t> max_iterations;
  double tolerance = 0;  // 0: the server's default
  std::optional<std::uint32_t> effort;
  std::optional<double> time_limit_seconds;
  int threads = 0;             // for a server in this process; 0: all cores
  std::optional<double> weld;  // tolerance, 0: the default; not set: no weld, except of glTF
  bool no_weld = false;        // not of glTF either
  bool normals = false;        // write normals also where the mesh file has none
  bool certify = false;        // print the optimality gap
  std::vector<std::filesystem::path> out;
  PictureOptions picture;
  std::optional<std::filesystem::path> report;
  ServerAccess server;
};

/// Deforms a mesh once and writes the outputs. Prints one line about the solve and one for each file.
ExitStatus run_deform(const DeformOptions& options);

}  // namespace lpdeform::cli
