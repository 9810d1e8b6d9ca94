#include "core/gltf/packing.h"

#include <optional>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/gltf/uris.h"
#include "core/io/mesh_io.h"
#include "core/io/whole_file.h"

namespace lpdeform::gltf {
namespace {

struct ImageFile {
  std::string media_type, bytes;
};

std::string media_type_of(const Json& image, const std::filesystem::path& file) {
  const Json* const given = value_of(image, "mimeType");
  if (given != nullptr && given->is_string()) return given->get<std::string>();
  const std::string ending = ending_of(file);
  if (ending == ".png" || ending == ".webp" || ending == ".ktx2") return "image/" + ending.substr(1);
  return ending == ".jpg" || ending == ".jpeg" ? "image/jpeg" : "";
}

/// The image if it is in a file that goes with the glTF.
std::optional<ImageFile> image_beside(const Document& document, std::size_t k) {
  const Json& image = item(document.root, "images", k);
  const auto file = image_file(image, document.folder);
  if (!file) return std::nullopt;
  std::string media_type = media_type_of(image, *file);
  if (media_type.empty()) return std::nullopt;
  auto bytes = read_whole_file(*file);
  if (bytes.ok()) return ImageFile{std::move(media_type), *std::move(bytes)};
  if (document.images_beside.contains(k))
    refuse(part_name(document.root, "images", k),
           absl::StrCat("is in the file \"", printable(image["uri"].get<std::string>()),
                        "\", which cannot be read any more"));
  return std::nullopt;
}

/// Appends at a multiple of four bytes, and returns where.
std::size_t append_aligned(std::string& to, const std::string& bytes) {
  to.append((4 - to.size() % 4) % 4, '\0');
  to += bytes;
  return to.size() - bytes.size();
}

/// The document with its buffers as one.
void join_buffers(Document& document) {
  Json& root = document.root;
  std::vector<std::size_t> begins;
  std::string all;
  for (const std::string& buffer : document.buffers) begins.push_back(append_aligned(all, buffer));
  for (std::size_t k = 0; begins.size() > 1 && k < count_of(root, "bufferViews"); ++k) {
    const std::string part = part_name(root, "bufferViews", k);
    const std::size_t begin =
        begins[needed_index(root, item(root, "bufferViews", k), "buffer", "buffers", part)];
    Json& view = root["bufferViews"][k];
    if (begin > 0) view["byteOffset"] = begin + whole(view, "byteOffset", 0, part);
    view["buffer"] = 0;
  }
  Json first = root["buffers"][0];
  first.erase("uri");
  root["buffers"] = Json::array({std::move(first)});
  document.buffers = {std::move(all)};
}

void put_images_in(Document& document) {
  Json& root = document.root;
  for (std::size_t k = 0; k < count_of(root, "images"); ++k) {
    const auto image = image_beside(document, k);
    if (!image) continue;
    const std::size_t begin = append_aligned(document.buffers[0], image->bytes);
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", begin}, {"byteLength", image->bytes.size()}});
    root["images"][k].erase("uri");
    root["images"][k]["mimeType"] = image->media_type;
    root["images"][k]["bufferView"] = root["bufferViews"].size() - 1;
  }
}

}  // namespace

std::string packed_glb(Document document) {
  join_buffers(document);
  put_images_in(document);
  document.root["buffers"][0]["byteLength"] = document.buffers[0].size();
  return glb_bytes(document.root.dump(), document.buffers[0], document.other_chunks);
}

std::string packed_gltf(Document document) {
  Json& root = document.root;
  for (std::size_t k = 0; k < document.buffers.size(); ++k) {
    root["buffers"][k]["byteLength"] = document.buffers[k].size();
    root["buffers"][k]["uri"] = data_uri("application/octet-stream", document.buffers[k]);
  }
  for (std::size_t k = 0; k < count_of(root, "images"); ++k) {
    if (const auto image = image_beside(document, k))
      root["images"][k]["uri"] = data_uri(image->media_type, image->bytes);
  }
  return root.dump(2) + "\n";
}

}  // namespace lpdeform::gltf
