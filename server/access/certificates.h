#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "server/access/tls_files.h"

namespace lpdeform {

/// What a server shows of itself over TLS, and whom it takes clients' certificates from: what files held when they were last
/// found good. Thread-safe.
class Certificates {
 public:
  struct Texts {
    std::string chain, key, authorities;  // in PEM; `authorities` empty where clients need show none
    bool operator==(const Texts&) const = default;
  };

  /// INVALID_ARGUMENT TLS_FILES where a file is missing, has a block that cannot be read, or chain and key are not of each other.
  static absl::StatusOr<std::shared_ptr<Certificates>> create(TlsFiles files);

  /// Reads the files again. Where they cannot be used, what was good before stays in force; errors as create's.
  absl::Status refresh();

  /// What is in force, and which of all that were, from 1 on.
  struct Current {
    std::shared_ptr<const Texts> texts;
    std::uint64_t number = 0;
  };
  Current current() const;

  bool knows_clients() const { return files_.knows_clients(); }

 private:
  explicit Certificates(TlsFiles files) : files_(std::move(files)) {}

  const TlsFiles files_;
  mutable std::mutex mutex_;
  Current current_;
};

}  // namespace lpdeform
