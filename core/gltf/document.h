#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/gltf/container.h"
#include "core/gltf/json_parts.h"

namespace lpdeform::gltf {

/// A glTF as it came: its JSON, with all that is unknown here, and the bytes of its buffers.
struct Document {
  Json root;
  std::vector<std::string> buffers;  // at least as long as their "byteLength"
  std::vector<Chunk> other_chunks;
  std::filesystem::path folder;  // where it lies: relative URIs begin there
};

/// Reads the JSON and all buffers. Throws a Refusal: no glTF 2, an extension that is required and changes what is drawn in
/// a way that is unknown here, geometry compressed by Draco or meshopt, a buffer that is missing, too short, or in a
/// file outside of `folder`.
Document parse_document(std::string_view bytes, const std::filesystem::path& folder);

}  // namespace lpdeform::gltf
