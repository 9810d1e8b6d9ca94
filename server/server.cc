#include "server/server.h"

#include <grpc/grpc.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "grpc/health/v1/health.pb.h"
#include "server/access/certificates.h"
#include "server/access/listener.h"
#include "server/access/tokens.h"
#include "server/access/transport_security.h"
#include "server/admin/admin.h"
#include "server/admin/grpc_log.h"
#include "server/admin/health_probe.h"
#include "server/admin/vital_signs.h"
#include "server/calls/backend.h"
#include "server/calls/open_calls.h"
#include "server/calls/service.h"
#include "server/calls/unread_calls.h"
#include "server/flags.h"
#include "server/runtime/file_watch.h"

namespace lpdeform {
namespace {

constexpr int kKeepaliveMs = 30'000;
/// gRPC closes a connection that pings more often. A proxy pings each connection three times a second to
/// notice a hung server.
constexpr int kLeastBetweenPingsMs = 200;
/// Limit of the headers of one call, counting 32 bytes extra per header. Beyond it gRPC 1.51 ends the
/// connection and all calls on it. The limit is above what a proxy lets through (max_request_headers_kb in
/// deploy/envoy.yaml.in). A bearer token may have 8 KiB.
constexpr int kMostHeaderBytes = 64 * 1024;
/// How long a new connection may take until it has spoken HTTP/2, TLS included.
constexpr int kHandshakeMs = 20'000;
constexpr std::chrono::seconds kAcceptPatience{5};
constexpr int kReflectionThreads = 16;
/// Between the last answer and the end of the connections. A client that writes to a closed connection loses
/// what it has not yet read from it, including the reason for its end.
constexpr std::chrono::milliseconds kLinger{100};

absl::Status check(ServerOptions options) {
  for (const Flag& flag : flags_of(options)) {
    if (absl::Status in_range = check_range(flag); !in_range.ok()) return in_range;
  }
  if (!options.token_keys_file.empty()) return absl::OkStatus();
  if (!options.token_issuer.empty()) return must_be("token-issuer", "given with --token-keys");
  if (!options.token_audience.empty()) return must_be("token-audience", "given with --token-keys");
  return absl::OkStatus();
}

/// Sets process-wide options of gRPC; called before the first server is made.
void prepare_grpc() {
  static std::once_flag once;
  std::call_once(once, [] {
    // Keeps gRPC up until the process ends. Shutting it down with its last server can take 10 s: it waits for
    // a poller of its own that nothing wakes.
    grpc_init();
    grpc::EnableDefaultHealthCheckService(true);
    grpc::reflection::InitProtoReflectionServerBuilderPlugin();
    // Reflection lists the health service, but can describe only what is linked into the program.
    static_cast<void>(grpc::health::v1::HealthCheckRequest::descriptor());
  });
}

bool tells_callers_apart(const ServerOptions& options) {
  return !options.token_keys_file.empty() || options.tls.knows_clients();
}

absl::Status check_anonymous(const ServerOptions& options, const Listener& listener) {
  if (tells_callers_apart(options) || options.allow_anonymous || listener.is_local()) return absl::OkStatus();
  return make_fault(
      {Reason::kAnonymousAddress, options.address, "loopback or unix"},
      absl::StrCat("Without authentication the server listens for this machine alone, not on ",
                   options.address,
                   "; give --token-keys or --tls-client-ca, or --allow-anonymous to let everybody in."));
}

/// Null if callers need no token.
absl::StatusOr<std::unique_ptr<Tokens>> make_tokens(const ServerOptions& options) {
  if (options.token_keys_file.empty()) return nullptr;
  return Tokens::create({options.token_keys_file, options.token_issuer, options.token_audience});
}

void warn_of_what_is_open(const ServerOptions& options, const Listener& listener, const Log& log) {
  if (!tells_callers_apart(options)) {
    log.warning("no_authentication",
                {{"address", listener.address()},
                 {"text", listener.is_local() ? "Every program on this machine is let in."
                                              : "Anyone who reaches the address may call."}});
  } else if (!options.tls.is_on() && !listener.is_local()) {
    log.warning("no_encryption", {{"address", listener.address()},
                                  {"text", "Tokens are sent unencrypted unless a proxy adds TLS."}});
  }
}

/// Whether the listener takes a connection made now. Does not test whether gRPC then answers: with TLS that
/// would need a client's certificate.
bool takes_connection(const Listener& listener) {
  const std::uint64_t before = listener.accepted();
  const auto channel = grpc::CreateChannel(listener.address(), grpc::InsecureChannelCredentials());
  channel->GetState(true);
  const auto end = std::chrono::steady_clock::now() + kAcceptPatience;
  while (listener.accepted() == before && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return listener.accepted() != before;
}

}  // namespace

struct Server::Impl {
  Impl(const ServerOptions& options, std::unique_ptr<Listener> to_take_from, std::unique_ptr<Tokens> tokens)
      : listener(std::move(to_take_from)),
        backend(options, std::move(tokens)),
        service(backend),
        vital_signs({[this, is_plain = !options.tls.is_on()] {
                       return is_plain ? is_serving(listener->address()) : takes_connection(*listener);
                     },
                     [this] { return listener->refused(); }, [this] { return backend.gate.is_closed(); },
                     backend.scheduler(), backend.pool()}) {}

  absl::Status start_grpc(const ServerOptions& options, std::shared_ptr<Certificates> shown);
  void start_listening(const ServerOptions& options);

  absl::Status start_admin(const std::string& at);

  const std::unique_ptr<Listener> listener;
  Backend backend;
  Service service;
  const VitalSigns vital_signs;
  std::shared_ptr<Certificates> certificates;  // null without TLS
  std::unique_ptr<grpc::experimental::ExternalConnectionAcceptor> acceptor;
  std::unique_ptr<grpc::Server> grpc_server;
  std::mutex draining;
  bool is_drained = false, is_all_kept = true;
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

absl::Status Server::Impl::start_grpc(const ServerOptions& options, std::shared_ptr<Certificates> shown) {
  certificates = std::move(shown);
  if (certificates)
    watch_files(backend.timers, files_of("certificate", certificates),
                options.log ? options.log : std::make_shared<Log>("off"));
  grpc::ServerBuilder builder;
  acceptor = builder.experimental().AddExternalConnectionAcceptor(
      grpc::ServerBuilder::experimental_type::ExternalConnectionType::FROM_FD,
      make_credentials(certificates));
  builder.RegisterService(&service);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS,
                             static_cast<int>(options.max_calls_per_connection));
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveMs);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kLeastBetweenPingsMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_MAX_METADATA_SIZE, kMostHeaderBytes);
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONNECTION_IDLE_MS,
                             static_cast<int>(options.connection_idle.count()));
  // Reflection uses a thread per call; all other calls use threads of this project.
  builder.SetResourceQuota(grpc::ResourceQuota("lpdeform").SetMaxThreads(kReflectionThreads));
  std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>> interceptors;
  interceptors.push_back(end_open_calls(backend.timers, options.connection_idle));
  interceptors.push_back(tell_of_unread_calls(backend));
  builder.experimental().SetInterceptorCreators(std::move(interceptors));
  // gRPC decompresses a message before it checks the decompressed size: 4 MiB received can become 4 GiB.
  builder.AddChannelArgument(GRPC_ARG_ENABLE_PER_MESSAGE_DECOMPRESSION, 0);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_GZIP, false);
  builder.SetCompressionAlgorithmSupportStatus(GRPC_COMPRESS_DEFLATE, false);
  // Probing grows the flow-control windows until they hold seconds of frames, which the credits do not count.
  builder.AddChannelArgument(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  grpc_server = builder.BuildAndStart();
  if (grpc_server == nullptr) return absl::InternalError("gRPC did not start.");
  grpc_server->GetHealthCheckService()->SetServingStatus(v1::DeformService::service_full_name(), true);
  return absl::OkStatus();
}

void Server::Impl::start_listening(const ServerOptions& options) {
  Listener::Events events;
  events.on_connection = [this](int listener_fd, int fd) {
    backend.metrics->add(Count::kConnections);
    grpc::experimental::ExternalConnectionAcceptor::NewConnectionParameters parameters;
    parameters.listener_fd = listener_fd;
    parameters.fd = fd;
    acceptor->HandleNewConnection(&parameters);
  };
  events.on_refused = [this] {
    backend.metrics->add(Count::kConnectionsRefused);
    backend.log().warning(
        "connection_refused",
        {{"text", "The limit of connections, from flags or file descriptors, is reached."}});
  };
  const std::size_t most =
      listener->start({options.max_connections, options.max_connections_per_address}, std::move(events));
  if (most < options.max_connections) {
    backend.log().warning("few_descriptors", {{"connections", std::uint64_t{most}},
                                              {"text", "Raise the limit of descriptors (ulimit -n)."}});
  }
}

absl::StatusOr<std::unique_ptr<Server>> Server::start(const ServerOptions& given) {
  ServerOptions options = given;
  if (options.max_bytes == 0) options.max_bytes = default_max_bytes();
  if (absl::Status status = check(options); !status.ok()) return status;
  absl::StatusOr<std::shared_ptr<Certificates>> certificates = nullptr;
  if (options.tls.is_on()) certificates = Certificates::create(options.tls);
  if (!certificates.ok()) return certificates.status();
  auto tokens = make_tokens(options);
  if (!tokens.ok()) return tokens.status();
  auto listener = Listener::bind(options.address);
  if (!listener.ok()) return listener.status();
  if (absl::Status status = check_anonymous(options, **listener); !status.ok()) return status;
  prepare_grpc();
  take_grpc_log(options.log);
  auto impl = std::make_unique<Impl>(options, *std::move(listener), *std::move(tokens));
  if (absl::Status status = impl->start_grpc(options, *certificates); !status.ok()) return status;
  impl->start_listening(options);
  auto server = std::unique_ptr<Server>(new Server(std::move(impl)));
  const Log& log = server->impl_->backend.log();
  if (!options.admin_address.empty()) {
    if (absl::Status status = server->impl_->start_admin(options.admin_address); !status.ok()) return status;
  }
  log.info("started", {{"address", server->address()},
                       {"tls", std::string(options.tls.is_on() ? "on" : "off")},
                       {"tokens", std::string(options.token_keys_file.empty() ? "off" : "on")}});
  warn_of_what_is_open(options, *server->impl_->listener, log);
  return server;
}

Server::Server(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Server::~Server() {
  drain(std::chrono::milliseconds(0));
}

const std::string& Server::address() const {
  return impl_->listener->address();
}

std::string Server::admin_address() const {
  return impl_->admin ? impl_->admin->address() : "";
}

bool Server::drain(std::chrono::milliseconds grace, const OnFlushed& on_flushed) {
  const std::scoped_lock lock(impl_->draining);
  if (std::exchange(impl_->is_drained, true)) return impl_->is_all_kept;
  Backend& backend = impl_->backend;
  const std::string text = "The server is shutting down.";
  backend.log().info("draining", {});
  backend.gate.close();
  impl_->grpc_server->GetHealthCheckService()->SetServingStatus(false);
  backend.registry->drain(text);
  backend.gate.wait_until_empty(std::chrono::steady_clock::now() + grace);
  std::this_thread::sleep_for(std::min(grace, kLinger));
  impl_->is_all_kept = backend.release_sessions(text);
  if (on_flushed) on_flushed(impl_->is_all_kept);
  impl_->listener->stop();
  impl_->grpc_server->Shutdown(
      std::chrono::system_clock::now());  // cancels the calls that are still under way
  impl_->grpc_server->Wait();
  backend.gate.wait_until_empty(std::chrono::steady_clock::time_point::max());
  backend.log().info("stopped", {});
  return impl_->is_all_kept;
}

}  // namespace lpdeform
