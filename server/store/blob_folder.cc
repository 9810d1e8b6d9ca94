#include "server/store/blob_folder.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <system_error>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "server/store/store.h"

namespace lpdeform {
namespace {

constexpr const char* kUnfinished = ".unfinished";

absl::Status failed(const std::string& path, int error) {
  const std::string why = std::system_category().message(error);
  return error == ENOSPC || error == EDQUOT ? store_full(why, "", path) : store_failing(why, path);
}

absl::Status failed(const std::string& path, const std::error_code& error) {
  return failed(path, error.value());
}

absl::Status write_all(int fd, std::string_view bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return failed(path, errno);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return fsync(fd) == 0 ? absl::OkStatus() : failed(path, errno);
}

/// Syncs the folder, so that a file's name is on the disk, too.
absl::Status sync_folder(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (fd < 0) return failed(path, errno);
  const absl::Cleanup close_it = [fd] { close(fd); };
  return fsync(fd) == 0 ? absl::OkStatus() : failed(path, errno);
}

absl::Status write_file(const std::string& path, std::string_view bytes) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (fd < 0) return failed(path, errno);
  const absl::Cleanup close_it = [fd] { close(fd); };
  return write_all(fd, bytes, path);
}

}  // namespace

absl::Status make_private_folder(const std::string& path) {
  std::error_code error;
  const std::filesystem::path above = std::filesystem::path(path).parent_path();
  if (!above.empty()) std::filesystem::create_directories(above, error);
  if (error) return failed(path, error);
  if (mkdir(path.c_str(), S_IRWXU) == 0) return absl::OkStatus();
  const int why = errno;
  return std::filesystem::is_directory(path, error) ? absl::OkStatus() : failed(path, why);
}

absl::StatusOr<BlobFolder> BlobFolder::open(const std::string& path) {
  if (absl::Status status = make_private_folder(path); !status.ok()) return status;
  // A folder made by an older server may be open to all users. On a disk without modes it stays so.
  static_cast<void>(chmod(path.c_str(), S_IRWXU));
  std::error_code error;
  for (auto file = std::filesystem::directory_iterator(path, error); !error && file != end(file);
       file.increment(error)) {
    if (absl::StrContains(file->path().filename().string(), kUnfinished)) {
      std::error_code ignored;
      std::filesystem::remove(file->path(), ignored);
    }
  }
  if (error) return failed(path, error);
  return BlobFolder(path);
}

absl::Status BlobFolder::write(const std::string& key, std::string_view bytes) const {
  const std::string file = file_of(key);
  if (::access(file.c_str(), F_OK) == 0) return absl::OkStatus();
  static std::atomic<std::uint64_t> writes = 0;
  const std::string unfinished = absl::StrCat(file, kUnfinished, ++writes);
  absl::Status status = write_file(unfinished, bytes);
  if (status.ok() && rename(unfinished.c_str(), file.c_str()) != 0) status = failed(file, errno);
  if (!status.ok()) {
    unlink(unfinished.c_str());
    return status;
  }
  return sync_folder(path_);
}

absl::StatusOr<std::string> BlobFolder::read(const std::string& key) const {
  const std::string path = file_of(key);
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (fd < 0 && errno == ENOENT) return session_damaged("its mesh is missing", path);
  if (fd < 0) return failed(path, errno);
  const absl::Cleanup close_it = [fd] { close(fd); };
  struct stat about = {};
  if (fstat(fd, &about) != 0) return failed(path, errno);
  std::string bytes(static_cast<std::size_t>(about.st_size), '\0');
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got = ::read(fd, bytes.data() + done, bytes.size() - done);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return failed(path, errno);
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  if (done == bytes.size() && blob_key(bytes) == key) return bytes;
  return session_damaged("its mesh is not what was written", path);
}

void BlobFolder::remove(const std::string& key) const {
  unlink(file_of(key).c_str());
}

absl::StatusOr<std::set<std::string>> BlobFolder::keys() const {
  std::set<std::string> keys;
  std::error_code error;
  for (auto file = std::filesystem::directory_iterator(path_, error); !error && file != end(file);
       file.increment(error)) {
    keys.insert(file->path().filename().string());
  }
  if (error) return failed(path_, error);
  return keys;
}

absl::StatusOr<std::uint64_t> BlobFolder::bytes() const {
  std::uint64_t sum = 0;
  std::error_code error;
  for (auto file = std::filesystem::directory_iterator(path_, error); !error && file != end(file);
       file.increment(error)) {
    std::error_code ignored;
    const std::uintmax_t size = file->file_size(ignored);
    if (!ignored) sum += size;
  }
  if (error) return failed(path_, error);
  return sum;
}

}  // namespace lpdeform
