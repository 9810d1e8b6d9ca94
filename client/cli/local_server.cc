#include "client/cli/local_server.h"

#include <stdlib.h>

#include <limits>
#include <string>
#include <system_error>
#include <utility>

#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/server.h"

namespace lpdeform::cli {
namespace {

/// A server for the user's own command: only the machine limits it.
ServerOptions options_for(const std::filesystem::path& folder, int threads) {
  ServerOptions options;
  options.address = "unix:" + (folder / "socket").string();
  options.threads = threads;
  options.max_vertices = 100'000'000;
  options.max_bytes = std::numeric_limits<std::size_t>::max() / 2;
  options.max_upload_bytes = std::uint64_t{1} << 36;
  return options;
}

}  // namespace

absl::StatusOr<std::unique_ptr<LocalServer>> LocalServer::start(int threads) {
  std::unique_ptr<LocalServer> local(new LocalServer());
  std::error_code error;
  std::string name = (std::filesystem::temp_directory_path(error) / "lpdeform-XXXXXX").string();
  if (error || mkdtemp(name.data()) == nullptr) {
    return make_fault({Reason::kFileNotWritten, name, ""},
                      "The folder for temporary files (TMPDIR, or /tmp) cannot be written to.");
  }
  local->folder_ = name;
  absl::StatusOr<std::unique_ptr<Server>> server = Server::start(options_for(local->folder_, threads));
  if (!server.ok()) return server.status();
  local->server_ = *std::move(server);
  return local;
}

LocalServer::~LocalServer() {
  server_.reset();
  std::error_code error;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, error);
}

std::string LocalServer::address() const {
  return server_->address();
}

}  // namespace lpdeform::cli
