#include "core/io/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <optional>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

absl::Status not_written(const std::filesystem::path& path, int error) {
  return make_fault(absl::ErrnoToStatusCode(error), {Reason::kFileNotWritten, path.string(), ""},
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

/// A name that is different for each call in each process.
std::filesystem::path name_beside(const std::filesystem::path& path) {
  static std::atomic<std::uint64_t> calls{0};
  std::filesystem::path name = path;
  name += absl::StrCat(".", ::getpid(), "-", calls++, ".partial");
  return name;
}

/// The status of the file at `path`; empty if there is none.
std::optional<struct stat> status_of(const std::filesystem::path& path) {
  struct stat found = {};
  return ::stat(path.c_str(), &found) == 0 ? std::optional(found) : std::nullopt;
}

/// Whether `path` is a device or something that another program has open. It is then written to, not replaced.
bool is_stream(const std::filesystem::path& path, const std::optional<struct stat>& there) {
  const std::string name = path.lexically_normal().string();
  return (there && !S_ISREG(there->st_mode)) || name.starts_with("/dev/") || name.starts_with("/proc/");
}

/// Returns 0 or the errno of what went wrong.
int write_stream(const std::filesystem::path& path, std::string_view bytes) {
  const int file = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file < 0) return errno;
  const int error = write_all(file, bytes);
  return ::close(file) != 0 && error == 0 ? errno : error;
}

/// The same.
int replace(const std::filesystem::path& path, const std::optional<struct stat>& there,
            std::string_view bytes) {
  const std::filesystem::path partial = name_beside(path);
  const int file = ::open(partial.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (file < 0) return errno;
  int error = write_all(file, bytes);
  if (there) {
    // A process that may write to the folder may replace a file of another user; the new file then belongs to this
    // process's user.
    if (::fchown(file, there->st_uid, there->st_gid) != 0)
      static_cast<void>(::fchown(file, -1, there->st_gid));
    static_cast<void>(::fchmod(file, there->st_mode & 0777));
  }
  if (::close(file) != 0 && error == 0) error = errno;
  if (error == 0 && std::rename(partial.c_str(), path.c_str()) != 0) error = errno;
  if (error != 0) ::unlink(partial.c_str());
  return error;
}

}  // namespace

absl::StatusOr<std::string> read_whole_file(const std::filesystem::path& path) {
  std::error_code error;
  // This check comes first, because opening a pipe would wait for a writer.
  const bool is_file = std::filesystem::is_regular_file(path, error);
  if (!is_file && std::filesystem::exists(path, error)) {
    const bool is_folder = std::filesystem::is_directory(path, error);
    return make_fault({Reason::kMeshFileNotFound, path.string(), "a plain file"},
                      absl::StrCat(path.string(), " is a ", is_folder ? "folder" : "pipe or a device",
                                   "; a mesh is read from a plain file."));
  }
  std::ifstream stream(path, std::ios::binary);
  const std::uintmax_t size = is_file ? std::filesystem::file_size(path, error) : 0;
  std::string bytes(error ? 0 : size, '\0');
  if (!is_file || error || !stream.read(bytes.data(), static_cast<std::streamsize>(bytes.size()))) {
    return make_fault({Reason::kMeshFileNotFound, path.string(), "a readable file"},
                      absl::StrCat("There is no file ", path.string(), " that can be read."));
  }
  return bytes;
}

absl::Status write_whole_file(const std::filesystem::path& path, std::string_view bytes) {
  const std::optional<struct stat> there = status_of(path);
  std::error_code ignored;
  int error = 0;
  if (is_stream(path, there)) {
    error = write_stream(path, bytes);
  } else {
    error = replace(there ? std::filesystem::canonical(path, ignored) : path, there, bytes);
  }
  return error == 0 ? absl::OkStatus() : not_written(path, error);
}

}  // namespace lpdeform
