#include "core/gltf/node_tree.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/gltf/accessors.h"

namespace lpdeform::gltf {
namespace {

using Children = std::vector<std::vector<std::size_t>>;

Eigen::Affine3d own_transform(const Json& node, const std::string& part) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  if (value_of(node, "matrix") != nullptr) {
    const std::vector<double> columns = numbers(node, "matrix", 16, part);
    result.matrix() = Eigen::Map<const Eigen::Matrix4d>(columns.data());
    if (!result.matrix().row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1)))
      refuse(part, "has a \"matrix\" that is not affine");
  }
  if (value_of(node, "translation") != nullptr)
    result.translate(Eigen::Vector3d(numbers(node, "translation", 3, part).data()));
  if (value_of(node, "rotation") != nullptr) {
    const std::vector<double> q = numbers(node, "rotation", 4, part);
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    if (!(rotation.norm() > 0)) refuse(part, "has a \"rotation\" of length 0");
    result.rotate(rotation.normalized());
  }
  if (value_of(node, "scale") != nullptr)
    result.scale(Eigen::Vector3d(numbers(node, "scale", 3, part).data()));
  if (!result.matrix().allFinite()) refuse(part, "has a transform that is not finite");
  return result;
}

std::vector<std::size_t> index_list(const Json& root, const Json& object, const char* key, const char* list,
                                    const std::string& part) {
  std::vector<std::size_t> indices;
  const Json* const values = value_of(object, key);
  if (values == nullptr) return indices;
  if (!values->is_array()) refuse(part, absl::StrCat("has \"", key, "\" that are no list"));
  for (const Json& value : *values) indices.push_back(checked_index(root, value, key, list, part));
  return indices;
}

/// The nodes below `roots`, each before its children. Throws if one is reached twice.
std::vector<std::size_t> walk(const Json& root, const Children& children,
                              const std::vector<std::size_t>& roots) {
  std::vector<std::size_t> order, open(roots.rbegin(), roots.rend());
  std::vector<bool> is_seen(children.size());
  while (!open.empty()) {
    const std::size_t node = open.back();
    open.pop_back();
    if (is_seen[node]) refuse(part_name(root, "nodes", node), "is reached twice: nodes must be trees");
    is_seen[node] = true;
    order.push_back(node);
    open.insert(open.end(), children[node].rbegin(), children[node].rend());
  }
  return order;
}

std::vector<std::size_t> roots_of(const Children& children) {
  std::vector<bool> has_parent(children.size());
  for (const auto& below : children) {
    for (const std::size_t node : below) has_parent[node] = true;
  }
  std::vector<std::size_t> roots;
  for (std::size_t node = 0; node < children.size(); ++node) {
    if (!has_parent[node]) roots.push_back(node);
  }
  return roots;
}

std::vector<std::size_t> scene_roots(const Json& root, const Children& children) {
  const std::size_t scenes = count_of(root, "scenes");
  if (scenes == 0) return roots_of(children);
  const std::size_t scene =
      value_of(root, "scene") != nullptr ? needed_index(root, root, "scene", "scenes", "the file") : 0;
  return index_list(root, item(root, "scenes", scene), "nodes", "nodes", part_name(root, "scenes", scene));
}

/// Where the joints of a skin place a mesh, if they all agree, otherwise the identity.
Eigen::Affine3d placement_of_skin(const Document& document, const NodeTree& tree, std::size_t number) {
  const Json& root = document.root;
  const Json& skin = item(root, "skins", number);
  const std::string part = part_name(root, "skins", number);
  const std::vector<std::size_t> joints = index_list(root, skin, "joints", "nodes", part);
  Table inverse;
  if (value_of(skin, "inverseBindMatrices") != nullptr) {
    inverse = read_table(document, needed_index(root, skin, "inverseBindMatrices", "accessors", part), 16);
    if (inverse.rows() < static_cast<Eigen::Index>(joints.size()))
      refuse(part, "has fewer \"inverseBindMatrices\" than joints");
  }
  Eigen::Matrix4d placed = Eigen::Matrix4d::Identity();
  for (std::size_t k = 0; k < joints.size(); ++k) {
    Eigen::Matrix4d one = tree.to_world[joints[k]].matrix();
    if (inverse.rows() > 0) {
      const Eigen::RowVectorXd columns = inverse.row(static_cast<Eigen::Index>(k));
      one *= Eigen::Map<const Eigen::Matrix4d>(columns.data());
    }
    if (k == 0) placed = one;
    if (!one.allFinite() || !one.isApprox(placed, 1e-3)) return Eigen::Affine3d::Identity();
  }
  if (!placed.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1), 1e-6)) return Eigen::Affine3d::Identity();
  placed.row(3) << 0, 0, 0, 1;
  return Eigen::Affine3d(placed);
}

}  // namespace

NodeTree read_nodes(const Document& document) {
  const Json& root = document.root;
  const std::size_t count = count_of(root, "nodes");
  Children children(count);
  NodeTree tree;
  for (std::size_t node = 0; node < count; ++node) {
    const std::string part = part_name(root, "nodes", node);
    const Json& object = item(root, "nodes", node);
    children[node] = index_list(root, object, "children", "nodes", part);
    tree.to_world.push_back(own_transform(object, part));
  }
  const std::vector<std::size_t> order = walk(root, children, roots_of(children));
  if (order.size() < count) refuse("the nodes", "go round in a circle");
  for (const std::size_t node : order) {
    for (const std::size_t child : children[node])
      tree.to_world[child] = tree.to_world[node] * tree.to_world[child];
  }
  tree.in_scene = walk(root, children, scene_roots(root, children));
  return tree;
}

Eigen::Affine3d placement(const Document& document, const NodeTree& tree, std::size_t node,
                          std::map<std::size_t, Eigen::Affine3d>& of_skins) {
  const Json& root = document.root;
  const Json& object = item(root, "nodes", node);
  if (value_of(object, "skin") == nullptr) return tree.to_world[node];
  const std::size_t number = needed_index(root, object, "skin", "skins", part_name(root, "nodes", node));
  const auto known = of_skins.find(number);
  if (known != of_skins.end()) return known->second;
  return of_skins.emplace(number, placement_of_skin(document, tree, number)).first->second;
}

}  // namespace lpdeform::gltf
