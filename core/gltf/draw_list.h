#pragma once

#include <Eigen/Geometry>
#include <compare>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/gltf/document.h"
#include "core/mesh/mesh.h"

namespace lpdeform::gltf {

/// The accessors of a primitive that a deformation changes.
struct Attributes {
  std::size_t position = 0;
  std::optional<std::size_t> normal, tangent;

  auto operator<=>(const Attributes&) const = default;
};

/// Vertices that one node draws: the elements of one set of accessors, which several primitives of its mesh may share.
struct Block {
  std::size_t node = 0, mesh = 0;
  Attributes attributes;
  std::vector<std::size_t> primitives;  // of the mesh
  Eigen::Affine3d placement = Eigen::Affine3d::Identity();
  Eigen::Index first = 0, count = 0;  // its vertices in the mesh of all blocks
};

/// The triangles of one primitive of a block, in the mesh of all blocks.
struct FaceRange {
  std::size_t block = 0, primitive = 0;
  Eigen::Index first = 0, count = 0;
};

/// What the scene draws as triangles.
struct DrawList {
  std::vector<Block> blocks;
  std::vector<FaceRange> ranges;
  TriangleMesh mesh;                 // of all blocks, where they are drawn
  std::vector<std::string> notices;  // sentences about what is left as it is
};

/// Throws a Refusal: no triangles, more than 20 million vertices, 40 million triangles or a million primitives, a primitive that
/// is compressed, or that has indices or accessors out of range.
DrawList read_draw_list(const Document& document);

}  // namespace lpdeform::gltf
