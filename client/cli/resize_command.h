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
  std::vector<double> x_axis, y_axis;     // both or none
  std::optional<double> weld;             // tolerance, 0: the default; not set: no weld, except of glTF
  bool no_weld = false;                   // not of glTF either
  int threads = 0;                        // for a server in this process; 0: all cores
  PictureOptions picture;
  ServerAccess server;
};

/// Content-aware resizing of a mesh to the extent of the scaled one along every axis. The least of the three
/// factors scales uniformly. Then there is one solve for each axis with a larger factor, each from the
/// previous result (core/resize/resize.h and resize_extents.h). Each result is blended with the mesh scaled
/// by that factor without sparing, as sparing.h finds for the given mesh. Prints one line per solve. The
/// distortion written to a .ply or shown in a .png is that of the last solve.
ExitStatus run_resize(const ResizeOptions& options);

}  // namespace lpdeform::cli
