#include "core/gltf/document.h"

#include <algorithm>
#include <array>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/gltf/uris.h"
#include "core/io/whole_file.h"

namespace lpdeform::gltf {
namespace {

constexpr std::uint64_t kMostBytes = std::uint64_t{1} << 32;

void check_version(const Json& root) {
  const Json* const asset = value_of(root, "asset");
  const Json* const version = asset != nullptr ? value_of(*asset, "version") : nullptr;
  if (version == nullptr || !version->is_string())
    refuse("the JSON", "has no \"asset\" with a \"version\", as every glTF has");
  const auto& text = version->get_ref<const std::string&>();
  if (!text.starts_with("2."))
    refuse_unsupported("the file", absl::StrCat("is glTF ", printable(text), "; glTF 2 is read"));
}

/// Extensions that leave the places of vertices alone; all else that is required could move them.
bool is_harmless(std::string_view extension) {
  constexpr std::array<std::string_view, 7> kParts{
      "_materials_", "_texture_", "_lights_", "_animation_", "_audio", "_xmp", "KHR_mesh_quantization"};
  return std::ranges::any_of(
      kParts, [&](std::string_view part) { return extension.find(part) != std::string_view::npos; });
}

bool is_compression(std::string_view extension) {
  return extension == "KHR_draco_mesh_compression" || extension.ends_with("_meshopt_compression");
}

/// Of those that are required: the compressions, or all others.
void check_extensions(const Json& root, bool of_compression) {
  for (std::size_t k = 0; k < count_of(root, "extensionsRequired"); ++k) {
    const Json& name = root["extensionsRequired"][k];
    if (!name.is_string()) refuse("\"extensionsRequired\"", "has an item that is no text");
    const auto& text = name.get_ref<const std::string&>();
    if (is_compression(text) == of_compression && !is_harmless(text))
      refuse_unsupported(absl::StrCat("the extension \"", printable(text), "\""),
                         "is required by the file and not known here");
  }
}

/// Meshopt compresses views of buffers; Draco compresses primitives, see draw_list.cc.
void check_views(const Json& root) {
  for (std::size_t k = 0; k < count_of(root, "bufferViews"); ++k) {
    const Json* const extensions = value_of(item(root, "bufferViews", k), "extensions");
    for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
      if (extensions != nullptr && value_of(*extensions, name) != nullptr)
        refuse_unsupported(part_name(root, "bufferViews", k),
                           absl::StrCat("is compressed by ", name, ", which is not read"));
    }
  }
}

std::string bytes_of_uri(const std::string& uri, const std::filesystem::path& folder,
                         const std::string& part) {
  if (is_data_uri(uri)) {
    auto data = data_of(uri);
    if (!data) refuse(part, "has a data URI that is not in base64");
    return *std::move(data);
  }
  const auto file = file_within(folder, uri);
  if (!file)
    refuse(part,
           absl::StrCat("is at \"", printable(uri), "\", which is no file within the folder of the glTF"));
  auto bytes = read_whole_file(*file);
  if (!bytes.ok())
    refuse(part, absl::StrCat("is in the file \"", printable(uri), "\", which cannot be read"));
  return *std::move(bytes);
}

/// Before any is read.
void check_lengths(const Json& root) {
  std::uint64_t all = 0;
  for (std::size_t k = 0; k < count_of(root, "buffers"); ++k) {
    const std::string part = part_name(root, "buffers", k);
    all += whole(item(root, "buffers", k), "byteLength", 0, part);
    if (all > kMostBytes)
      refuse_unsupported(part, "takes the buffers beyond 4 GiB, which is as much as a GLB holds");
  }
}

std::string read_buffer(const Json& root, std::size_t k, const Container& container,
                        const std::filesystem::path& folder) {
  const Json& buffer = item(root, "buffers", k);
  const std::string part = part_name(root, "buffers", k);
  const std::uint64_t length = whole(buffer, "byteLength", 0, part);
  const Json* const uri = value_of(buffer, "uri");
  if (uri == nullptr && (k > 0 || !container.binary))
    refuse(part, "has no bytes: neither a URI nor a chunk BIN");
  if (uri != nullptr && !uri->is_string()) refuse(part, "has a URI that is no text");
  std::string bytes =
      uri == nullptr ? std::string(*container.binary) : bytes_of_uri(uri->get<std::string>(), folder, part);
  if (bytes.size() < length) refuse(part, absl::StrCat("has ", bytes.size(), " bytes in place of ", length));
  bytes.resize(length);
  bytes.shrink_to_fit();  // many buffers may be the beginning of one file
  return bytes;
}

std::set<std::size_t> find_images_beside(const Json& root, const std::filesystem::path& folder) {
  std::set<std::size_t> found;
  for (std::size_t k = 0; k < count_of(root, "images"); ++k) {
    const auto file = image_file(item(root, "images", k), folder);
    std::error_code error;
    if (file && std::filesystem::is_regular_file(*file, error)) found.insert(k);
  }
  return found;
}

/// The program may change its folder before the file is written.
std::filesystem::path whole_path(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::path whole = std::filesystem::absolute(folder.empty() ? "." : folder, error);
  return error ? folder : whole;
}

}  // namespace

std::optional<std::filesystem::path> image_file(const Json& image, const std::filesystem::path& folder) {
  const Json* const uri = value_of(image, "uri");
  if (uri == nullptr || !uri->is_string() || is_data_uri(uri->get_ref<const std::string&>()))
    return std::nullopt;
  return file_within(folder, uri->get_ref<const std::string&>());
}

void check_compressions(const Document& document) {
  check_extensions(document.root, true);
}

Document parse_document(std::string_view bytes, const std::filesystem::path& folder) {
  Container container = parse_container(bytes);
  Document document{parse_json(container.json), {}, std::move(container.others), whole_path(folder), {}};
  check_version(document.root);
  check_extensions(document.root, false);
  check_views(document.root);
  check_lengths(document.root);
  for (std::size_t k = 0; k < count_of(document.root, "buffers"); ++k)
    document.buffers.push_back(read_buffer(document.root, k, container, document.folder));
  document.images_beside = find_images_beside(document.root, document.folder);
  return document;
}

}  // namespace lpdeform::gltf
