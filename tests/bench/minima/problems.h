#pragma once

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <string_view>
#include <vector>

#include "core/shapes/shapes.h"
#include "tests/bench/scale/families.h"

namespace lpdeform {

/// A problem of the bench of minima: a shape, a pose and a material.
struct MinimaProblem {
  std::string name;  // "creature 2 mixed"
  TriangleMesh mesh;
  HandleSet handles;
  Material material;
};

inline constexpr std::array kMinimaShapes = {"box",      "bumps", "holes", "necked", "sphere",
                                             "creature", "scan",  "tree",  "block",  "rocker"};

inline TriangleMesh minima_shape(std::string_view name) {
  if (name == "box") return box_surface(3, 24, 48);
  if (name == "bumps") return grid(60, 60, 3.0);
  if (name == "holes") return block_with_holes(21, 9, 5);
  if (name == "necked") return necked_bar(10, 60, 4, 12);
  if (name == "sphere") return sphere(4);
  if (name == "creature") return creature_of(5000);
  if (name == "scan") return family_of("scan", 4000);
  if (name == "tree") return family_of("tree", 6000);
  if (name == "block") return pierced_block(30);
  return rocker_arm(48);
}

/// p from 1 at one end of the longest axis to 6 at the other.
inline Material mixed_material(const TriangleMesh& mesh) {
  const Eigen::RowVector3d low = mesh.vertices.colwise().minCoeff();
  const Eigen::RowVector3d size = mesh.vertices.colwise().maxCoeff() - low;
  Eigen::Index axis;
  size.maxCoeff(&axis);
  Material material;
  material.p = 1 + 5 * (mesh.vertices.col(axis).array() - low[axis]) / size[axis];
  return material;
}

/// Sixty problems: each of the ten shapes in two poses, the first at p = 1, 1.5 and 6, the second at p = 1, 1.5 and mixed.
inline MinimaProblem minima_problem(int number) {
  const std::string_view shape = kMinimaShapes[static_cast<std::size_t>(number / 6)];
  const int pose = number % 6 / 3, material = number % 3;
  MinimaProblem problem;
  problem.mesh = minima_shape(shape);
  problem.handles = family_pose(problem.mesh, static_cast<unsigned>(pose + 1));
  const std::string_view p = material == 0 ? "1" : material == 1 ? "1.5" : pose == 0 ? "6" : "mixed";
  problem.material = p == "mixed" ? mixed_material(problem.mesh)
                                  : Material::uniform(material == 0   ? 1
                                                      : material == 1 ? 1.5
                                                                      : 6);
  problem.name = std::string(shape) + " " + std::to_string(pose + 1) + " " + std::string(p);
  return problem;
}

}  // namespace lpdeform
