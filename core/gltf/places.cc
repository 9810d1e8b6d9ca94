#include "core/gltf/places.h"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/gltf/accessors.h"

namespace lpdeform::gltf {
namespace {

/// Keys whose values are accessors, in glTF and its extensions.
constexpr std::array<std::string_view, 5> kAccessorKeys{"indices", "inverseBindMatrices", "input", "output",
                                                        "accessor"};

bool overlap(std::uint64_t begin, std::uint64_t end, std::uint64_t other_begin, std::uint64_t other_end) {
  return begin < other_end && other_begin < end;
}

/// Whether elements of two accessors share bytes. Interleaved ones have one stride and different places within it.
bool share_bytes(const Layout& a, const Layout& b) {
  if (a.buffer != b.buffer || !overlap(a.begin, a.end(), b.begin, b.end())) return false;
  if (a.stride != b.stride) return true;
  const std::uint64_t gap = (b.begin + a.stride - a.begin % a.stride) % a.stride;
  return gap < a.size || gap + b.size > a.stride;
}

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
    views_.push_back({needed_index(root, view, "buffer", "buffers", part), begin,
                      begin + whole(view, "byteLength", 0, part)});
  }
  for (std::size_t k = 0; k < count_of(root, "accessors"); ++k) {
    const Json* const view = value_of(root["accessors"][k], "bufferView");
    if (view != nullptr && view->is_number_unsigned())
      accessors_of_view_[view->get<std::size_t>()].push_back(k);
  }
}

bool Places::has_bytes_alone(std::size_t accessor) const {
  const Json& object = document_.root["accessors"][accessor];
  if (object["componentType"] != kFloat || value_of(object, "sparse") != nullptr) return false;
  const std::size_t own_view = object["bufferView"].get<std::size_t>();
  const Layout own = layout_of(document_, accessor);
  for (std::size_t k = 0; k < views_.size(); ++k) {
    const auto& [buffer, begin, end] = views_[k];
    const bool is_there = buffer == own.buffer && overlap(own.begin, own.end(), begin, end);
    if (is_there && (k != own_view || other_views_.contains(k))) return false;
  }
  return std::ranges::none_of(accessors_of_view_.at(own_view), [&](std::size_t other) {
    return other != accessor && share_bytes(own, layout_of(document_, other));
  });
}

bool Places::take(std::size_t accessor) {
  if (used_elsewhere_.contains(accessor) || taken_.contains(accessor) || !has_bytes_alone(accessor))
    return false;
  taken_.insert(accessor);
  return true;
}

}  // namespace lpdeform::gltf
