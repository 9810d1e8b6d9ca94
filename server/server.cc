#include "server/server.h"

#include <grpc/grpc.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "server/admin.h"
#include "server/backend.h"
#include "server/health_probe.h"
#include "server/service.h"
#include "server/vital_signs.h"

namespace lpdeform {
namespace {

constexpr int kMostCallsAConnection = 256;
constexpr int kKeepaliveMs = 30'000;
/// Between the last answer and the end of the connections: who writes to a connection that has ended loses what he
/// has not read of it yet, the reason for its end among that.
constexpr std::chrono::milliseconds kLinger{100};

absl::Status out_of_range(const std::string& name, const std::string& limit) {
  return invalid_input({"OPTION_OUT_OF_RANGE", name, limit},
                       absl::StrCat("Option ", name, " must be ", limit, "."));
}

absl::Status check(const ServerOptions& options) {
  if (options.threads < 0 || options.threads > 1024) return out_of_range("threads", "0 to 1024");
  if (options.runner_threads < 0 || options.runner_threads == 1 || options.runner_threads > 1024) {
    return out_of_range("runner_threads", "0 or 2 to 1024");
  }
  if (options.max_vertices == 0 || options.max_vertices > 100'000'000)
    return out_of_range("max_vertices", "1 to 10^8");
  if (!(options.max_stream_bytes_per_second >= 0) || std::isinf(options.max_stream_bytes_per_second)) {
    return out_of_range("max_stream_bytes_per_second", "finite and >= 0");
  }
  if (options.heartbeat.count() <= 0) return out_of_range("heartbeat", "more than 0");
  if (options.session_idle.count() <= 0) return out_of_range("session_idle", "more than 0");
  if (options.upload_idle.count() <= 0) return out_of_range("upload_idle", "more than 0");
  return absl::OkStatus();
}

/// Process-wide settings of gRPC, made before the first server is.
void prepare_grpc() {
  static std::once_flag once;
  std::call_once(once, [] {
    // Keeps gRPC up until the process ends. Taking it down with its last server can take 10 s: it waits for a poller
    // of its own that nothing wakes.
    grpc_init();
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  });
}

/// The address with the port that was found in place of a port 0.
std::string with_port(const std::string& address, int port) {
  if (absl::StartsWith(address, "unix:")) return address;
  return absl::StrCat(address.substr(0, address.rfind(':')), ":", port);
}

}  // namespace

struct Server::Impl {
  explicit Impl(const ServerOptions& options)
      : backend(options),
        service(backend),
        vital_signs({[this] { return is_serving(address); }, [this] { return backend.gate.is_closed(); },
                     backend.scheduler, backend.pool}) {}

  absl::Status start_admin(const std::string& at);

  Backend backend;
  Service service;
  const VitalSigns vital_signs;
  std::unique_ptr<grpc::Server> grpc_server;
  std::string address;
  std::mutex draining;
  bool is_drained = false;
  std::unique_ptr<Admin> admin;  // last, so that its threads end first
};

absl::Status Server::Impl::start_admin(const std::string& at) {
  const auto health = [this](bool (VitalSigns::Finding::*is_well)() const) {
    return [this, is_well] {
      const VitalSigns::Finding finding = vital_signs.examine();
      return Admin::Answer{(finding.*is_well)() ? 200 : 503, "application/json", finding.json()};
    };
  };
  auto started =
      Admin::start(at, {{"/metrics",
                         [this] {
                           return Admin::Answer{200, "text/plain; version=0.0.4", backend.metrics_text()};
                         }},
                        {"/healthz", health(&VitalSigns::Finding::is_ready)},
                        {"/livez", health(&VitalSigns::Finding::is_alive)}});
  if (!started.ok()) return started.status();
  admin = *std::move(started);
  return absl::OkStatus();
}

absl::StatusOr<std::unique_ptr<Server>> Server::start(const ServerOptions& options) {
  if (absl::Status status = check(options); !status.ok()) return status;
  prepare_grpc();
  auto impl = std::make_unique<Impl>(options);
  int port = 0;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(options.address, grpc::InsecureServerCredentials(), &port);
  builder.RegisterService(&impl->service);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);  // a port that is taken is an error
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMostCallsAConnection);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kKeepaliveMs / 3);
  // Probing grows windows until seconds of frames hide in them, behind the credits' back.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  impl->grpc_server = builder.BuildAndStart();
  if (impl->grpc_server == nullptr || (port == 0 && !absl::StartsWith(options.address, "unix:"))) {
    return make_fault(absl::StatusCode::kUnavailable, {"ADDRESS_NOT_BOUND", options.address, ""},
                      absl::StrCat("The server cannot listen on ", options.address, "; is it taken?"));
  }
  impl->grpc_server->GetHealthCheckService()->SetServingStatus(v1::DeformService::service_full_name(), true);
  impl->address = with_port(options.address, port);
  if (!options.admin_address.empty()) {
    if (absl::Status status = impl->start_admin(options.admin_address); !status.ok()) return status;
  }
  impl->backend.log().info("started", {{"address", impl->address}});
  return std::unique_ptr<Server>(new Server(std::move(impl)));
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() {
  drain(std::chrono::milliseconds(0));
}

const std::string& Server::address() const {
  return impl_->address;
}

std::string Server::admin_address() const {
  return impl_->admin ? impl_->admin->address() : "";
}

void Server::drain(std::chrono::milliseconds grace) {
  const std::scoped_lock lock(impl_->draining);
  if (std::exchange(impl_->is_drained, true)) return;
  Backend& backend = impl_->backend;
  const std::string text = "The server is shutting down.";
  backend.log().info("draining", {});
  backend.gate.close();
  impl_->grpc_server->GetHealthCheckService()->SetServingStatus(false);
  backend.registry->drain(text);
  backend.gate.wait_until_empty(std::chrono::steady_clock::now() + grace);
  std::this_thread::sleep_for(std::min(grace, kLinger));
  backend.registry->clear(EndReason::kDraining, text);
  impl_->grpc_server->Shutdown(std::chrono::system_clock::now());  // cancels what is still under way
  impl_->grpc_server->Wait();
  backend.gate.wait_until_empty(std::chrono::steady_clock::time_point::max());
  backend.log().info("stopped", {});
}

}  // namespace lpdeform
