#pragma once

#include <sqlite3.h>

#include <array>
#include <atomic>
#include <cstddef>

namespace lpdeform {

/// A disk that SQLite finds full, as a test says when: files that are there may be written to as far as they reach, and none may grow.
/// So it is of a disk that another program has filled to the last byte. In force for databases that are opened from now on.
class FullDisk {
 public:
  FullDisk() {
    sqlite3_vfs* const real = sqlite3_vfs_find(nullptr);
    real_ = real;
    shim_ = *real;
    shim_.zName = "full_disk";
    shim_.xOpen = open;
    sqlite3_vfs_register(&shim_, 1);
  }
  ~FullDisk() {
    is_full_ = false;
    sqlite3_vfs_register(real_, 1);
    sqlite3_vfs_unregister(&shim_);
  }
  FullDisk(const FullDisk&) = delete;
  FullDisk& operator=(const FullDisk&) = delete;

  static void set_full(bool is_full) { is_full_ = is_full; }

 private:
  /// A kind of files: SQLite's methods, with ours in place of some.
  struct Methods {
    sqlite3_io_methods ours;
    const sqlite3_io_methods* real;
  };

  static const sqlite3_io_methods& real_of(sqlite3_file* file) {
    return *reinterpret_cast<const Methods*>(file->pMethods)->real;
  }

  static int open(sqlite3_vfs*, const char* name, sqlite3_file* file, int flags, int* given) {
    const int result = real_->xOpen(real_, name, file, flags, given);
    if (file->pMethods == nullptr) return result;
    for (Methods& kind : kinds_) {
      if (kind.real == nullptr) {
        kind = {*file->pMethods, file->pMethods};
        kind.ours.xWrite = write;
        kind.ours.xFileControl = control;
      }
      if (kind.real != file->pMethods) continue;
      file->pMethods = &kind.ours;
      break;
    }
    return result;
  }

  static bool may_reach(sqlite3_file* file, sqlite3_int64 end) {
    sqlite3_int64 size = 0;
    return !is_full_ || (real_of(file).xFileSize(file, &size) == SQLITE_OK && end <= size);
  }
  static int write(sqlite3_file* file, const void* bytes, int count, sqlite3_int64 at) {
    return may_reach(file, at + count) ? real_of(file).xWrite(file, bytes, count, at) : SQLITE_FULL;
  }
  static int control(sqlite3_file* file, int what, void* value) {
    if (what == SQLITE_FCNTL_SIZE_HINT && !may_reach(file, *static_cast<sqlite3_int64*>(value)))
      return SQLITE_IOERR_WRITE;
    return real_of(file).xFileControl(file, what, value);
  }

  static inline std::atomic<bool> is_full_ = false;
  static inline sqlite3_vfs* real_ = nullptr;
  static inline std::array<Methods, 4> kinds_{};
  sqlite3_vfs shim_{};
};

}  // namespace lpdeform
