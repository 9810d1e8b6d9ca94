#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <map>
#include <vector>

#include "core/gltf/document.h"

namespace lpdeform::gltf {

struct NodeTree {
  std::vector<Eigen::Affine3d> to_world;  // of each node of the file
  std::vector<std::size_t>
      in_scene;  // the nodes of the scene: each before its children, these in their order
};

/// The scene is the file's default one, else its first, else all nodes. Throws a Refusal if nodes are no trees, or if a
/// transform is not finite.
NodeTree read_nodes(const Document& document);

/// What takes the vertices of the node's mesh to where they are drawn. A mesh with a skin stands where its joints place it if
/// they all agree, as they do in the pose of binding, and otherwise as its file has it; its node's transform counts for nothing.
/// `of_skins` keeps the placement of each skin for the next node that has it.
Eigen::Affine3d placement(const Document& document, const NodeTree& tree, std::size_t node,
                          std::map<std::size_t, Eigen::Affine3d>& of_skins);

}  // namespace lpdeform::gltf
