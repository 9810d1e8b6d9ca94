#pragma once

#include <string>

#include "tests/core/poses.h"

namespace lpdeform {

/// A deformation of the paper's Table 1: a generated shape with its counts of vertices and faces, and handles
/// like its figure's.
struct PaperPose {
  std::string name;
  TriangleMesh mesh;
  HandleSet handles;
};

inline PaperPose paper_bar() {  // Fig. 4, 370 / 736
  const TriangleMesh mesh = box_surface(4, 4, 21);
  HandleSet handles;
  (void)handles.set("end_a", {slice(mesh, 2, 0, 0), Fixed{}});
  (void)handles.set("end_b", {slice(mesh, 2, 21, 21), Fixed{}});
  (void)handles.set("middle", {slice(mesh, 2, 10, 11), turn(Eigen::Vector3d::UnitZ(), 90, {2, 2, 10.5})});
  return {"bar", mesh, handles};
}

inline PaperPose paper_sheet() {  // Fig. 3, 3962 / 7920: one edge is folded over the other by translation
  const TriangleMesh mesh = box_surface(2, 30, 60);
  HandleSet handles;
  (void)handles.set("fixed", {slice(mesh, 2, 0, 1), Fixed{}});
  (void)handles.set("edge", {slice(mesh, 2, 59, 60), RigidMotion{.translation = {20, 0, -25}}});
  return {"sheet", mesh, handles};
}

inline PaperPose paper_block() {  // Fig. 5, 2132 / 4272: a block of genus 3 is stretched
  const TriangleMesh mesh = block_with_holes(28, 12, 8);
  HandleSet handles;
  (void)handles.set("fixed", {slice(mesh, 0, 0, 0), Fixed{}});
  (void)handles.set("end", {slice(mesh, 0, 28, 28), RigidMotion{.translation = {14, 0, 0}}});
  return {"block", mesh, handles};
}

}  // namespace lpdeform
