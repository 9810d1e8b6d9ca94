#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace lpdeform::gltf {

/// Whether a URI holds its bytes itself: "data:application/octet-stream;base64,AAAA".
bool is_data_uri(std::string_view uri);

/// The bytes of such a URI, or nothing if they are not in base64.
std::optional<std::string> data_of(std::string_view uri);

std::string data_uri(std::string_view media_type, std::string_view bytes);

/// The file that a relative URI names, if it lies within `folder`, links followed. Nothing for any other URI, such as
/// "https:...", "/etc/passwd" or "../a.bin".
std::optional<std::filesystem::path> file_within(const std::filesystem::path& folder, std::string_view uri);

}  // namespace lpdeform::gltf
