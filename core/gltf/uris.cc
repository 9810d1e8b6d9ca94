#include "core/gltf/uris.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <system_error>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace lpdeform::gltf {
namespace {

/// "a%20b" is "a b". Nothing if a percent sign has no two hexadecimal digits, or stands for a null byte.
std::optional<std::string> percent_decoded(std::string_view uri) {
  std::string text;
  for (std::size_t k = 0; k < uri.size(); ++k) {
    if (uri[k] != '%') {
      text += uri[k];
      continue;
    }
    const std::string_view digits = uri.substr(k + 1, 2);
    const auto is_digit = [](char c) { return std::isxdigit(static_cast<unsigned char>(c)) != 0; };
    if (digits.size() < 2 || !std::ranges::all_of(digits, is_digit)) return std::nullopt;
    unsigned char byte = 0;
    std::from_chars(digits.data(), digits.data() + digits.size(), byte, 16);
    text += static_cast<char>(byte);
    k += 2;
  }
  if (text.find('\0') != std::string::npos) return std::nullopt;
  return text;
}

}  // namespace

bool is_data_uri(std::string_view uri) {
  return uri.starts_with("data:");
}

std::optional<std::string> data_of(std::string_view uri) {
  constexpr std::string_view kMark = ";base64,";
  const std::size_t mark = uri.find(kMark);
  if (!is_data_uri(uri) || mark == std::string_view::npos) return std::nullopt;
  uri.remove_prefix(mark + kMark.size());
  std::string bytes;
  if (!absl::Base64Unescape({uri.data(), uri.size()}, &bytes)) return std::nullopt;
  return bytes;
}

std::string data_uri(std::string_view media_type, std::string_view bytes) {
  return absl::StrCat("data:", std::string(media_type), ";base64,",
                      absl::Base64Escape({bytes.data(), bytes.size()}));
}

std::optional<std::filesystem::path> file_within(const std::filesystem::path& folder, std::string_view uri) {
  const auto name = percent_decoded(uri);
  const bool has_scheme = uri.substr(0, uri.find('/')).find(':') != std::string_view::npos;
  if (!name || name->empty() || has_scheme || std::filesystem::path(*name).is_absolute()) return std::nullopt;
  std::error_code error;
  const std::filesystem::path own = std::filesystem::weakly_canonical(folder.empty() ? "." : folder, error);
  if (error) return std::nullopt;
  std::filesystem::path file = std::filesystem::weakly_canonical(own / *name, error);
  if (error) return std::nullopt;
  const auto parting = std::mismatch(own.begin(), own.end(), file.begin(), file.end());
  return parting.first == own.end() ? std::optional(std::move(file)) : std::nullopt;
}

}  // namespace lpdeform::gltf
