#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <set>
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
  std::filesystem::path folder;         // where it lies, absolute: relative URIs begin there
  std::set<std::size_t> images_beside;  // those that were in files there when it was read
};

/// Reads the JSON and all buffers. Throws a Refusal: no glTF 2, an extension that is required and changes what is drawn in
/// a way that is unknown here, geometry compressed by Draco or meshopt, a buffer that is missing, too short, or in a
/// file outside of `folder`, buffers of more than 4 GiB together.
Document parse_document(std::string_view bytes, const std::filesystem::path& folder);

/// Throws a Refusal if the file requires a compression of geometry. It is for the end: what the scene draws is refused before, by the
/// part that is compressed.
void check_compressions(const Document& document);

/// The file within `folder` that the image names, which may not be there.
std::optional<std::filesystem::path> image_file(const Json& image, const std::filesystem::path& folder);

}  // namespace lpdeform::gltf
