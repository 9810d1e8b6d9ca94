#include "core/gltf/places.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/gltf/accessors.h"
#include "core/gltf/alone.h"

namespace lpdeform::gltf {
namespace {

/// Keys whose values are accessors, in glTF and its extensions.
constexpr std::array<std::string_view, 5> kAccessorKeys{"indices", "inverseBindMatrices", "input", "output",
                                                        "accessor"};

}  // namespace

Places::Places(const Document& document, const DrawList& list) : document_(document) {
  find_meshes(list);
  find_uses(list);
  find_views();
}

void Places::find_meshes(const DrawList& list) {
  std::set<std::size_t> drawing;
  for (const Block& block : list.blocks) drawing.insert(block.node);
  for (std::size_t node = 0; node < count_of(document_.root, "nodes"); ++node) {
    const Json* const mesh = value_of(document_.root["nodes"][node], "mesh");
    if (mesh != nullptr && mesh->is_number_unsigned() && !drawing.contains(node))
      meshes_elsewhere_.insert(mesh->get<std::size_t>());
  }
}

void Places::find_uses(const DrawList& list) {
  std::set<std::pair<std::size_t, std::size_t>> drawn;
  for (const Block& block : list.blocks) {
    for (const std::size_t primitive : block.primitives) drawn.insert({block.mesh, primitive});
  }
  Json rest = document_.root;
  for (const auto& [mesh, primitive] : drawn) {
    if (is_mesh_elsewhere(mesh)) continue;
    Json& attributes = rest["meshes"][mesh]["primitives"][primitive]["attributes"];
    for (const char* const name : {"POSITION", "NORMAL", "TANGENT"}) attributes.erase(name);
  }
  for (std::size_t k = 0; k < count_of(rest, "accessors"); ++k) {
    if (Json& one = rest["accessors"][k]; one.is_object()) one.erase("bufferView");
  }
  find_uses_within(rest);
}

void Places::find_uses_within(const Json& value) {
  if (value.is_array()) {
    for (const Json& inner : value) find_uses_within(inner);
  }
  if (!value.is_object()) return;
  for (const auto& [key, inner] : value.items()) {
    if (key == "bufferView" && inner.is_number_unsigned()) other_views_.insert(inner.get<std::size_t>());
    if (std::ranges::find(kAccessorKeys, key) != kAccessorKeys.end()) add_use(inner);
    if (key == "attributes" && inner.is_object()) {
      for (const auto& [name, accessor] : inner.items()) add_use(accessor);
    }
    if (key == "targets" && inner.is_array()) {
      for (const Json& target : inner) {
        for (const auto& [name, accessor] : target.items()) add_use(accessor);
      }
    }
    find_uses_within(inner);
  }
}

void Places::add_use(const Json& value) {
  if (value.is_number_unsigned()) used_elsewhere_.insert(value.get<std::size_t>());
}

void Places::find_views() {
  const Json& root = document_.root;
  for (std::size_t k = 0; k < count_of(root, "bufferViews"); ++k) {
    const Json& view = item(root, "bufferViews", k);
    const std::string part = part_name(root, "bufferViews", k);
    const std::uint64_t begin = whole(view, "byteOffset", 0, part);
    Bounds& bounds = bounds_of_views_[needed_index(root, view, "buffer", "buffers", part)];
    bounds.begins.push_back(begin);
    bounds.ends.push_back(begin + whole(view, "byteLength", 0, part));
  }
  for (auto& [buffer, bounds] : bounds_of_views_) {
    std::ranges::sort(bounds.begins);
    std::ranges::sort(bounds.ends);
  }
  for (std::size_t k = 0; k < count_of(root, "accessors"); ++k) {
    const Json* const view = value_of(root["accessors"][k], "bufferView");
    if (view != nullptr && view->is_number_unsigned())
      accessors_of_view_[view->get<std::size_t>()].push_back(k);
  }
}

std::ptrdiff_t Places::views_within(const Layout& layout) const {
  const auto& [begins, ends] = bounds_of_views_.at(layout.buffer);
  const auto begun = std::ranges::lower_bound(begins, layout.end()) - begins.begin();
  const auto ended = std::ranges::upper_bound(ends, layout.begin) - ends.begin();
  return begun - ended;
}

const std::set<std::size_t>& Places::alone_in(std::size_t view) {
  const auto [found, is_new] = alone_in_view_.try_emplace(view);
  if (!is_new) return found->second;
  const std::vector<std::size_t>& accessors = accessors_of_view_.at(view);
  std::vector<Layout> layouts;
  for (const std::size_t accessor : accessors) layouts.push_back(layout_of(document_, accessor));
  const std::vector<bool> are_alone = alone(layouts, share_bytes);
  for (std::size_t k = 0; k < accessors.size(); ++k) {
    if (are_alone[k]) found->second.insert(accessors[k]);
  }
  return found->second;
}

bool Places::has_bytes_alone(std::size_t accessor) {
  const Json& object = document_.root["accessors"][accessor];
  if (object["componentType"] != kFloat || value_of(object, "sparse") != nullptr) return false;
  const std::size_t own_view = object["bufferView"].get<std::size_t>();
  return !other_views_.contains(own_view) && views_within(layout_of(document_, accessor)) <= 1 &&
         alone_in(own_view).contains(accessor);
}

bool Places::take(std::size_t accessor) {
  if (used_elsewhere_.contains(accessor) || taken_.contains(accessor) || !has_bytes_alone(accessor))
    return false;
  taken_.insert(accessor);
  return true;
}

}  // namespace lpdeform::gltf
