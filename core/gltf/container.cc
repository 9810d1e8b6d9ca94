#include "core/gltf/container.h"

#include <cstdint>

#include "absl/strings/str_cat.h"
#include "core/gltf/json_parts.h"
#include "core/io/byte_order.h"

namespace lpdeform::gltf {
namespace {

constexpr std::size_t kHeader = 12, kChunkHeader = 8;
constexpr std::string_view kMagic = "glTF";
constexpr std::string_view kJson = "JSON";
constexpr std::string_view kBinary("BIN\0", 4);

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  return load_little_endian<std::uint32_t>(bytes.data() + at);
}

void append_chunk(std::string& bytes, std::string_view type, std::string_view data, char filling) {
  const std::size_t padding = (4 - data.size() % 4) % 4;
  append_little_endian(bytes, static_cast<std::uint32_t>(data.size() + padding));
  bytes += type;
  bytes += data;
  bytes.append(padding, filling);
}

Container parse_glb(std::string_view bytes) {
  if (bytes.size() < kHeader) refuse("the GLB file", "ends within its header");
  if (number_at(bytes, 4) != 2) {
    refuse_unsupported("the GLB file",
                       absl::StrCat("is of version ", number_at(bytes, 4), "; version 2 is read"));
  }
  if (number_at(bytes, 8) > bytes.size()) {
    refuse("the GLB file", absl::StrCat("ends after ", bytes.size(), " of ", number_at(bytes, 8), " bytes"));
  }
  bytes = bytes.substr(0, number_at(bytes, 8));
  Container container;
  for (std::size_t at = kHeader, k = 0; at < bytes.size(); ++k) {
    const std::string part = absl::StrCat("chunk ", k, " of the GLB file");
    if (bytes.size() - at < kChunkHeader) refuse(part, "ends within its header");
    const std::size_t length = number_at(bytes, at);
    const std::string_view type = bytes.substr(at + 4, 4);
    at += kChunkHeader;
    if (length > bytes.size() - at)
      refuse(part,
             absl::StrCat("has ", length, " bytes by its header, and ", bytes.size() - at, " are there"));
    const std::string_view data = bytes.substr(at, length);
    at += length;
    if ((k == 0) != (type == kJson))
      refuse(part, k == 0 ? "is not JSON" : "is JSON, which comes first and once");
    if (k == 0) {
      container.json = data;
    } else if (type == kBinary && k == 1) {
      container.binary = data;
    } else {
      container.others.push_back({std::string(type), std::string(data)});
    }
  }
  if (container.json.empty()) refuse("the GLB file", "has no JSON");
  return container;
}

}  // namespace

Container parse_container(std::string_view bytes) {
  if (bytes.starts_with(kMagic)) return parse_glb(bytes);
  constexpr std::string_view kMark = "\xef\xbb\xbf";  // some editors begin UTF-8 with it
  if (bytes.starts_with(kMark)) bytes.remove_prefix(kMark.size());
  return {bytes, std::nullopt, {}};
}

std::string glb_bytes(std::string_view json, std::string_view binary, const std::vector<Chunk>& others) {
  std::string chunks;
  append_chunk(chunks, kJson, json, ' ');
  if (!binary.empty()) append_chunk(chunks, kBinary, binary, '\0');
  for (const Chunk& chunk : others) append_chunk(chunks, chunk.type, chunk.data, '\0');
  if (chunks.size() + kHeader > 0xffffffff)
    refuse_unsupported("the result", "is larger than 4 GiB, which no GLB file holds");
  std::string bytes(kMagic);
  append_little_endian(bytes, std::uint32_t{2});
  append_little_endian(bytes, static_cast<std::uint32_t>(kHeader + chunks.size()));
  return bytes + chunks;
}

}  // namespace lpdeform::gltf
