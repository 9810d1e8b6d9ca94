#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "absl/status/statusor.h"

namespace lpdeform {
class Server;
}

namespace lpdeform::cli {

/// The service in this process, on a socket in a folder that no other user can enter. The folder is removed
/// with this object.
class LocalServer {
 public:
  /// `threads`: as the server's own option; 0 takes all cores.
  static absl::StatusOr<std::unique_ptr<LocalServer>> start(int threads);
  ~LocalServer();

  /// For Client::connect.
  std::string address() const;

 private:
  LocalServer() = default;
  std::filesystem::path folder_;
  std::unique_ptr<Server> server_;
};

}  // namespace lpdeform::cli
