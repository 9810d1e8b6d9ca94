#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/exit_status.h"
#include "client/cli/files/outputs.h"
#include "client/cli/server_access.h"

namespace lpdeform::cli {

struct ResizeOptions {
  std::filesystem::path mesh;
  std::filesystem::path out;
  std::vector<double> scale = {1, 1, 1};  // along the axes, each 0.01 to 100
  std::vector<double> origin;             // x, y, z; empty: the middle of the mesh's bounding box
  std::vector<double> x_axis, y_axis;     // directions; both or none
  std::optional<double> weld;             // its tolerance, 0: the default; none: vertices stay as they are
  int threads = 0;                        // of the server in this process; 0: all cores
  PictureOptions picture;
  ServerAccess server;
};

/// Content-aware resizing of a mesh to the extent of the scaled one along every axis: the least of the three factors by
/// plain scaling, then, as core/resize/resize.h and resize_extents.h have it, one solve for each axis that
/// differs from it, each from the result before, blended with the plain scaling by sparing.h of the mesh as it is given. Prints
/// one line a solve. The distortion written to a .ply or shown in a .png is that of the last solve.
ExitStatus run_resize(const ResizeOptions& options);

}  // namespace lpdeform::cli
