#include "client/cli/files/text_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>
#include <system_error>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/io/whole_file.h"

namespace lpdeform::cli {

absl::Status not_written(const std::filesystem::path& path, std::string_view why) {
  return make_fault({Reason::kFileNotWritten, path.string(), ""},
                    absl::StrCat("\"", path.string(), "\" cannot be written: ", std::string(why), "."));
}

absl::StatusOr<std::string> read_text(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream file(path, std::ios::binary);
  if (!file || std::filesystem::is_directory(path, error)) {
    return make_fault({Reason::kFileNotFound, path.string(), ""},
                      absl::StrCat("\"", path.string(), "\" cannot be read."));
  }
  return std::string(std::istreambuf_iterator<char>(file), {});
}

absl::Status write_text(const std::filesystem::path& path, std::string_view text) {
  return write_whole_file(path, text);
}

absl::Status check_folder(const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return not_written(path, absl::StrCat("there is no folder \"", folder.string(), "\"").c_str());
  }
  if (std::filesystem::is_directory(path, error)) return not_written(path, "it is a folder");
  const std::filesystem::path& changed = std::filesystem::exists(path, error) ? path : folder;
  if (access(changed.c_str(), W_OK) != 0) return not_written(path, std::strerror(errno));
  return absl::OkStatus();
}

}  // namespace lpdeform::cli
