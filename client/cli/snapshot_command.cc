#include "client/cli/snapshot_command.h"

#include <cstdio>
#include <string>

#include "client/cli/files/text_file.h"
#include "client/cpp/client.h"

namespace lpdeform::cli {
namespace {

absl::StatusOr<client::Client> connect(const ServerAccess& access) {
  auto options = client_options(access);
  if (!options.ok()) return options.status();
  return client::Client::connect(*access.address, *std::move(options));
}

}  // namespace

ExitStatus run_snapshot(const SnapshotOptions& options) {
  if (absl::Status status = check_folder(options.file); !status.ok()) return complain(status);
  auto server = connect(options.server);
  if (!server.ok()) return complain(server.status());
  const auto bytes = server->snapshot(options.session);
  if (!bytes.ok()) return complain(bytes.status());
  if (absl::Status status = write_text(options.file, *bytes); !status.ok()) return complain(status);
  std::printf("wrote %s, %zu bytes\n", options.file.c_str(), bytes->size());
  return kDone;
}

ExitStatus run_restore(const RestoreOptions& options) {
  const auto bytes = read_text(options.file);
  if (!bytes.ok()) return complain(bytes.status());
  auto server = connect(options.server);
  if (!server.ok()) return complain(server.status());
  const auto session = server->restore(*bytes);
  if (!session.ok()) return complain(session.status());
  std::printf("%s\n", session->c_str());
  return kDone;
}

}  // namespace lpdeform::cli
