#pragma once

#include <vector>

#include "client/cli/render/camera.h"
#include "client/cli/render/raster.h"
#include "core/base/colour.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// A mesh and its colours. All indices must be in range, and all points that faces use must be finite.
struct Surface {
  Faces faces;
  Points positions;
  Field heat;                // one value from 0 (blue) to 1 (red) per vertex, or empty
  std::vector<Rgb> colours;  // used without heat: one per vertex; if empty, the mesh is plain
};

/// A mesh drawn in front of a camera: what is visible at each sample of a picture of width x height samples.
class Scene {
 public:
  /// At least one face. Everything is copied or drawn, so nothing needs to outlive the call. The camera's
  /// picture has width x height samples.
  Scene(const Surface& surface, Camera camera, int width, int height);

  /// The same without colours, with a camera that shows all points that faces use.
  Scene(const Faces& faces, const Points& positions, const Field& heat, int width, int height);

  /// The colour of a sample. `openness`: as in shaded(); Openness computes it.
  Rgb colour_at(int x, int y, double openness) const;

  /// Whether the side x side samples from (x, y) on show a single face, or only background.
  bool is_one_face(int x, int y, int side) const;

  /// The surface point that this sample shows; NaN on the background.
  Eigen::RowVector3d point_at(int x, int y) const;
  /// The normal of the surface on the viewer's side, of length 1. Undefined on the background.
  Eigen::RowVector3d normal_at(int x, int y) const { return normal_towards_camera(raster_.at(x, y)); }

  int width() const { return raster_.width(); }
  int height() const { return raster_.height(); }
  /// Diagonal of the bounding box of what is drawn, in the mesh's unit of length.
  double diagonal() const;

 private:
  Rgb albedo_at(const Raster::Sample& sample) const;
  static Eigen::RowVector3d inside(const Points& corner_values, const Raster::Sample& sample) {
    const Eigen::Index first = 3 * Eigen::Index{sample.face};
    return (1 - sample.b - sample.c) * corner_values.row(first) + sample.b * corner_values.row(first + 1) +
           sample.c * corner_values.row(first + 2);
  }
  Eigen::RowVector3d normal_towards_camera(const Raster::Sample& sample) const;

  Points corners_, normals_;  // 3 f + k for corner k of face f
  Field heat_;                // the same, or empty
  Points colours_;            // red, green, blue for the same, or empty
  Camera camera_;
  Raster raster_;
};

}  // namespace lpdeform
