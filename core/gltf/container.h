#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lpdeform::gltf {

/// A chunk of a GLB file that glTF 2.0 does not know.
struct Chunk {
  std::string type;  // four bytes
  std::string data;
};

/// What a GLB file, or a glTF file, which is JSON alone, consists of.
struct Container {
  std::string_view json;
  std::optional<std::string_view> binary;  // the chunk BIN
  std::vector<Chunk> others;
};

/// Views into `bytes`. A file that begins with "glTF" is a GLB. Throws a Refusal (core/gltf/json_parts.h).
Container parse_container(std::string_view bytes);

/// A GLB file.
std::string glb_bytes(std::string_view json, std::string_view binary, const std::vector<Chunk>& others);

}  // namespace lpdeform::gltf
