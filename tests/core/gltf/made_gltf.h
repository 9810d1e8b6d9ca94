#pragma once

#include <cstring>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/gltf/container.h"

namespace lpdeform::gltf {

/// A glTF that a test makes part by part, with one buffer. Each function returns the index of what it adds.
struct MadeGltf {
  nlohmann::ordered_json root{{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}}};
  std::string buffer;

  template <typename Number>
  int view(const std::vector<Number>& numbers, int stride = 0) {
    buffer.append((4 - buffer.size() % 4) % 4, '\0');
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", buffer.size()}, {"byteLength", numbers.size() * sizeof(Number)}});
    if (stride > 0) root["bufferViews"].back()["byteStride"] = stride;
    buffer.append(reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(Number));
    return static_cast<int>(root["bufferViews"].size()) - 1;
  }

  int accessor(int view, const char* type, int component, int count, int offset = 0) {
    root["accessors"].push_back({{"bufferView", view},
                                 {"componentType", component},
                                 {"count", count},
                                 {"type", type},
                                 {"byteOffset", offset}});
    return static_cast<int>(root["accessors"].size()) - 1;
  }

  int floats(const std::vector<float>& numbers, const char* type, int columns) {
    return accessor(view(numbers), type, 5126, static_cast<int>(numbers.size()) / columns);
  }

  int indices(const std::vector<std::uint16_t>& numbers) {
    return accessor(view(numbers), "SCALAR", 5123, static_cast<int>(numbers.size()));
  }

  int mesh(nlohmann::ordered_json primitives) {
    root["meshes"].push_back({{"primitives", std::move(primitives)}});
    return static_cast<int>(root["meshes"].size()) - 1;
  }

  int node(nlohmann::ordered_json node) {
    root["nodes"].push_back(std::move(node));
    return static_cast<int>(root["nodes"].size()) - 1;
  }

  std::string glb() {
    root["buffers"] = {{{"byteLength", buffer.size()}}};
    return glb_bytes(root.dump(), buffer, {});
  }
};

/// A square of two triangles in the plane z = 0, split along its diagonal as texture seams split it.
inline const std::vector<float> kSquare{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0};

/// The square with everything that a primitive can have, and things beside it that nobody here knows.
inline MadeGltf rich_gltf() {
  MadeGltf made;
  const int position = made.floats(kSquare, "VEC3", 3);
  const int normal = made.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3", 3);
  const int tangent =
      made.floats({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1}, "VEC4", 4);
  const int texture = made.floats({0, 0, 1, 0, 1, 1, 0.5, 0.5, 0.75, 0.5, 0.75, 0.75}, "VEC2", 2);
  const int morph = made.floats(std::vector<float>(18, 0.125F), "VEC3", 3);
  const int joints = made.accessor(made.view(std::vector<std::uint8_t>(24, 0)), "VEC4", 5121, 6);
  const int weights = made.floats(std::vector<float>(24, 0.25F), "VEC4", 4);
  const int corners = made.indices({0, 1, 2, 3, 4, 5});
  made.view(std::vector<std::uint8_t>{0x89, 'P', 'N', 'G', 1, 2, 3});
  made.root["images"] = {{{"bufferView", made.root["bufferViews"].size() - 1}, {"mimeType", "image/png"}}};
  made.root["materials"] = {
      {{"name", "paper"}, {"extensions", {{"KHR_materials_unlit", nlohmann::ordered_json::object()}}}}};
  made.root["extensionsUsed"] = {"KHR_materials_unlit", "ACME_secret"};
  made.root["extensions"] = {{"ACME_secret", {{"keep", {1, 2.5, "me"}}}}};
  made.root["unheard of"] = true;
  made.mesh({{{"attributes",
               {{"POSITION", position},
                {"NORMAL", normal},
                {"TANGENT", tangent},
                {"TEXCOORD_0", texture},
                {"JOINTS_0", joints},
                {"WEIGHTS_0", weights},
                {"_OWN", weights}}},
              {"indices", corners},
              {"material", 0},
              {"targets", {{{"POSITION", morph}}}}}});
  made.root["meshes"][0]["name"] = "sheet";
  made.root["meshes"][0]["weights"] = {0.5};
  made.root["meshes"][0]["extras"] = {{"note", "an extra"}};
  made.root["accessors"][position]["min"] = {0, 0, 0};
  made.root["accessors"][position]["max"] = {1, 1, 0};
  made.node({{"mesh", 0}, {"name", "page"}, {"extras", 7}});
  return made;
}

}  // namespace lpdeform::gltf
