#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/statusor.h"
#include "server/access/tls_files.h"

namespace lpdeform {

/// The server's certificate for TLS, and the authorities that it accepts clients' certificates from, as last
/// read from valid files. Thread-safe.
class Certificates {
 public:
  struct Texts {
    std::string chain, key, authorities;  // in PEM; `authorities` is empty if clients need no certificate
    bool operator==(const Texts&) const = default;
  };

  /// INVALID_ARGUMENT TLS_FILES if a file is missing, has a block that cannot be read, or if the private key
  /// does not fit the chain.
  static absl::StatusOr<std::shared_ptr<Certificates>> create(TlsFiles files);

  /// Reads the files again. If they cannot be used, the last valid contents stay in force. Errors: as
  /// create().
  absl::Status refresh();

  /// The contents in force, and their version number, from 1 on.
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
