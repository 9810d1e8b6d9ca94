#include "core/mesh/whole_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"

namespace lpdeform {
namespace {

absl::Status not_written(const std::filesystem::path& path, int error) {
  return make_fault(absl::ErrnoToStatusCode(error), {"FILE_NOT_WRITTEN", path.string(), ""},
                    absl::StrCat("Cannot write ", path.string(), ": ", std::strerror(error), "."));
}

/// Returns 0 or the errno of what went wrong.
int write_all(int file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

/// Different for each call in each process.
std::filesystem::path name_beside(const std::filesystem::path& path) {
  static std::atomic<std::uint64_t> calls{0};
  std::filesystem::path name = path;
  name += absl::StrCat(".", ::getpid(), "-", calls++, ".partial");
  return name;
}

}  // namespace

absl::StatusOr<std::string> read_whole_file(const std::filesystem::path& path) {
  std::error_code error;
  std::ifstream stream(path, std::ios::binary);
  const bool is_file = std::filesystem::is_regular_file(path, error);
  const std::uintmax_t size = is_file ? std::filesystem::file_size(path, error) : 0;
  std::string bytes(error ? 0 : size, '\0');
  if (!is_file || error || !stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    return make_fault(absl::StatusCode::kNotFound, {"MESH_FILE_NOT_FOUND", path.string(), "a readable file"},
                      absl::StrCat("There is no file ", path.string(), " that can be read."));
  }
  return bytes;
}

absl::Status write_whole_file(const std::filesystem::path& path, std::string_view bytes) {
  const std::filesystem::path partial = name_beside(path);
  const int file = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) return not_written(path, errno);
  int error = write_all(file, bytes);
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && std::rename(partial.c_str(), path.c_str()) != 0) error = errno;
  if (error == 0) return absl::OkStatus();
  ::unlink(partial.c_str());
  return not_written(path, error);
}

}  // namespace lpdeform
