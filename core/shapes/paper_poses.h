#pragma once

#include <string>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// A deformation of the paper's section 4 on a generated shape, with handles like those of the figure.
///
/// `size` multiplies the number of cells along each side and must be at least kSmallestPoseSize. At 1 the meshes have
/// the paper's number of vertices, exactly or approximately. Unit and position of each shape: core/shapes/shapes.h.
struct PaperPose {
  std::string name;
  TriangleMesh mesh;
  HandleSet handles;
  std::string note;  // what the handles do
};

inline constexpr double kSmallestPoseSize = 0.25;

PaperPose paper_sheet(double size = 1);     // Fig. 3: one edge stays, the other is translated over it
PaperPose paper_bar(double size = 1);       // Fig. 4: both ends stay, the middle is turned by 90 degrees
PaperPose paper_block(double size = 1);     // Fig. 5: pierced_block; one end stays, the other is pulled
PaperPose paper_creature(double size = 1);  // Fig. 6: the feet stay, the head is lifted and turned
PaperPose paper_arm(double size = 1);       // Fig. 7: rocker_arm; the tail's end stays, the head is pulled

/// The vertices of `rest` with low <= coordinate <= high along an axis, ascending.
std::vector<std::int32_t> vertices_between(const Points& rest, int axis, double low, double high);

}  // namespace lpdeform
