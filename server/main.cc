#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "core/base/fault.h"
#include "server/admin/health_probe.h"
#include "server/process_end.h"
#include "server/runtime/machine_memory.h"
#include "server/server.h"
#include "server/store/open_store.h"

namespace {

using lpdeform::ServerOptions;

/// The exit statuses other than 0.
constexpr int kRefused = 1, kNotKept = 2;

/// How long the process may take to end by itself after it has waited for the store. It is less if the store
/// hangs, because nothing can be saved any more.
constexpr std::chrono::seconds kToEnd{10}, kToEndWithout{2};

/// The range that clocks can count.
constexpr double kMostSeconds = 1e9, kLeastSeconds = 1e-3;

struct Arguments {
  ServerOptions server;
  double session_idle_seconds = 600, upload_idle_seconds = 600, heartbeat_seconds = 15, grace_seconds = 20;
  double connection_idle_seconds = 300;
  std::string max_bytes_per_caller = "50%";
  std::string log_level = "info";
  std::string store = "none";
  lpdeform::StoreOptions store_options;
  std::string probed;
};

std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(seconds * 1000));
}

/// Accepts "4GiB" or "4096". CLI11's own validator takes -1 for the largest size.
CLI::Validator size_in_bytes() {
  return {[](std::string& text) -> std::string {
            if (text.find('-') != std::string::npos) return "must not be negative";
            return CLI::AsSizeValue(false)(text);
          },
          "SIZE"};
}

/// The number before "%"; empty unless that is a number from 1 to 100.
std::optional<double> percent_of(const std::string& text) {
  double percent = 0;
  if (text.empty() || text.back() != '%') return std::nullopt;
  const bool is_number = CLI::detail::lexical_cast(text.substr(0, text.size() - 1), percent);
  return is_number && percent >= 1 && percent <= 100 ? std::optional(percent) : std::nullopt;
}

/// Accepts also "25%", which stays as it is.
CLI::Validator size_or_percent() {
  return {[](std::string& text) -> std::string {
            if (text.empty() || text.back() != '%') return size_in_bytes()(text);
            return percent_of(text) ? "" : "must be 1% to 100%, or a size";
          },
          "SIZE"};
}

/// Accepts also "25%": a share of the memory of the machine or its control group.
CLI::Validator size_or_share() {
  return {[](std::string& text) -> std::string {
            if (std::string why = size_or_percent()(text); !why.empty()) return why;
            if (const auto percent = percent_of(text)) {
              const double bytes = static_cast<double>(lpdeform::memory_of_process()) * *percent / 100;
              text = std::to_string(static_cast<std::uint64_t>(bytes));
            }
            return "";
          },
          "SIZE"};
}

/// Refuses also what is not a number.
CLI::Validator seconds_from(double least) {
  return {[least](std::string& text) -> std::string {
            double seconds = 0;
            const bool is_number = CLI::detail::lexical_cast(text, seconds);
            if (is_number && seconds >= least && seconds <= kMostSeconds) return "";
            char limits[64];
            std::snprintf(limits, sizeof(limits), "must be %g to %g seconds", least, kMostSeconds);
            return limits;
          },
          "SECONDS"};
}

void describe(CLI::App& app, Arguments& arguments) {
  ServerOptions& server = arguments.server;
  app.description(
      "Deforms triangle meshes as a gRPC service (lpdeform.v1). Every option may also be given by the "
      "environment "
      "variable named beside it. SIGTERM and SIGINT stop it gracefully. It exits with 0 then; with 2 where "
      "the store did not take all that "
      "was answered, which the log says by session; with 1 where it does not start.");
  app.add_option("--address", server.address, "Where to listen: HOST:PORT (port 0: a free one) or unix:/PATH")
      ->envname("LPDEFORM_ADDRESS")
      ->capture_default_str();
  app.add_option(
         "--admin-address", server.admin_address,
         "Where to answer GET /metrics (Prometheus), /healthz (ready) and /livez (alive) over plain HTTP: "
         "HOST:PORT; empty: nowhere")
      ->envname("LPDEFORM_ADMIN_ADDRESS")
      ->capture_default_str();
  app.add_option("--tls-cert", server.tls.certificate_chain,
                 "Serve with TLS: the certificate chain, in PEM; read again when it changes")
      ->envname("LPDEFORM_TLS_CERT");
  app.add_option("--tls-key", server.tls.private_key, "The certificate's private key, in PEM")
      ->envname("LPDEFORM_TLS_KEY");
  app.add_option("--tls-client-ca", server.tls.client_authorities,
                 "Let in only clients with a certificate that one of these signed, in PEM (mutual TLS)")
      ->envname("LPDEFORM_TLS_CLIENT_CA");
  app.add_option("--token-keys", server.token_keys_file,
                 "Let in only callers with a bearer token (JWT) that one of these public keys signed, in "
                 "PEM; read again "
                 "when it changes")
      ->envname("LPDEFORM_TOKEN_KEYS");
  app.add_option("--token-issuer", server.token_issuer, "What the tokens' \"iss\" must be (not looked at)")
      ->envname("LPDEFORM_TOKEN_ISSUER");
  app.add_option("--token-audience", server.token_audience,
                 "What the tokens' \"aud\" must have in it (not looked at)")
      ->envname("LPDEFORM_TOKEN_AUDIENCE");
  app.add_flag("--allow-anonymous", server.allow_anonymous,
               "Without --token-keys and --tls-client-ca, serve other machines, too: whoever reaches the "
               "address is let "
               "in")
      ->envname("LPDEFORM_ALLOW_ANONYMOUS");
  app.add_option("--max-connections", server.max_connections,
                 "Connections at a time, 1 to 10^6; more are closed at once")
      ->envname("LPDEFORM_MAX_CONNECTIONS")
      ->capture_default_str();
  app.add_option(
         "--max-connections-per-address", server.max_connections_per_address,
         "Connections at a time from one address, or one IPv6 network of 64 bits; 0: without limit. Behind a "
         "proxy all come from its address")
      ->envname("LPDEFORM_MAX_CONNECTIONS_PER_ADDRESS")
      ->capture_default_str();
  app.add_option("--connection-idle", arguments.connection_idle_seconds,
                 "Seconds without a call after which a connection is closed, 1 to 2e6; calls of the health "
                 "service and "
                 "of reflection, which need no token, last no longer")
      ->envname("LPDEFORM_CONNECTION_IDLE")
      ->check(CLI::Range(1.0, 2e6))
      ->capture_default_str();
  app.add_option("--max-sessions-per-caller", server.max_sessions_per_caller,
                 "Sessions of one caller at a time, where callers are told apart; 0: without limit")
      ->envname("LPDEFORM_MAX_SESSIONS_PER_CALLER")
      ->capture_default_str();
  app.add_option("--max-streams-per-caller", server.max_streams_per_caller,
                 "Streams of one caller at a time, where callers are told apart; 0: without limit")
      ->envname("LPDEFORM_MAX_STREAMS_PER_CALLER")
      ->capture_default_str();
  app.add_option("--max-uploads-per-caller", server.max_uploads_per_caller,
                 "Uploads of one caller at a time, where callers are told apart; 0: without limit")
      ->envname("LPDEFORM_MAX_UPLOADS_PER_CALLER")
      ->capture_default_str();
  app.add_option("--max-bytes-per-caller", arguments.max_bytes_per_caller,
                 "Memory of one caller's sessions and uploads, where callers are told apart; as 4GiB, in "
                 "bytes, or as "
                 "25% of --max-bytes; 0: without limit")
      ->envname("LPDEFORM_MAX_BYTES_PER_CALLER")
      ->transform(size_or_percent())
      ->capture_default_str();
  app.add_option("--max-upload-rate", server.max_upload_bytes_per_second,
                 "Bytes a second of one caller's uploads, where callers are told apart; 0: without limit")
      ->envname("LPDEFORM_MAX_UPLOAD_RATE")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--threads", server.threads, "Threads that one solve may use; 0: all cores")
      ->envname("LPDEFORM_THREADS")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--runner-threads", server.runner_threads,
                 "Threads that sessions take turns on, at least 2; 0: max(4, twice the cores)")
      ->envname("LPDEFORM_RUNNER_THREADS")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str();
  app.add_option("--max-sessions", server.max_sessions, "Sessions at a time")
      ->envname("LPDEFORM_MAX_SESSIONS")
      ->capture_default_str();
  app.add_option("--max-streams-per-session", server.max_streams_per_session,
                 "Streams of one session at a time")
      ->envname("LPDEFORM_MAX_STREAMS_PER_SESSION")
      ->capture_default_str();
  app.add_option("--max-handles", server.max_handles, "Handles of one session")
      ->envname("LPDEFORM_MAX_HANDLES")
      ->capture_default_str();
  app.add_option("--max-undo", server.max_undo, "Steps of its handles that a session can take back; 0: none")
      ->envname("LPDEFORM_MAX_UNDO")
      ->capture_default_str();
  app.add_option("--max-uploads", server.max_uploads, "Uploads at a time")
      ->envname("LPDEFORM_MAX_UPLOADS")
      ->capture_default_str();
  app.add_option("--max-calls-waiting", server.max_calls_waiting,
                 "Calls that wait for a thread to look at them")
      ->envname("LPDEFORM_MAX_CALLS_WAITING")
      ->capture_default_str();
  app.add_option("--max-calls-per-connection", server.max_calls_per_connection,
                 "Calls on one connection at a time, streams included; more wait in the client")
      ->envname("LPDEFORM_MAX_CALLS_PER_CONNECTION")
      ->capture_default_str();
  app.add_option("--max-vertices", server.max_vertices, "Vertices of one mesh; of faces, three times as many")
      ->envname("LPDEFORM_MAX_VERTICES")
      ->capture_default_str();
  app.add_option("--max-bytes", server.max_bytes,
                 "Memory of all sessions and of what has come of uploads; as 4GiB, in bytes, or as 25% of "
                 "what the machine or "
                 "its control group has; 0: 75%")
      ->envname("LPDEFORM_MAX_BYTES")
      ->transform(size_or_share())
      ->capture_default_str();
  app.add_option("--max-upload-bytes", server.max_upload_bytes, "Size of one upload; as 256MiB or in bytes")
      ->envname("LPDEFORM_MAX_UPLOAD_BYTES")
      ->transform(size_in_bytes())
      ->capture_default_str();
  app.add_option("--max-stream-rate", server.max_stream_bytes_per_second,
                 "Bytes a second of one stream's frames, 0: without limit; lowers the frame rate first, to "
                 "10 a second, "
                 "then the precision where the client takes less")
      ->envname("LPDEFORM_MAX_STREAM_RATE")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--max-frame-rate", server.max_stream_frames_per_second,
                 "Frames a second of one stream, 0: without limit; the last of an update always comes")
      ->envname("LPDEFORM_MAX_FRAME_RATE")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  app.add_option("--session-idle", arguments.session_idle_seconds,
                 "Seconds without use after which a session goes")
      ->envname("LPDEFORM_SESSION_IDLE")
      ->check(seconds_from(kLeastSeconds))
      ->capture_default_str();
  app.add_option("--upload-idle", arguments.upload_idle_seconds,
                 "Seconds without use after which an upload goes")
      ->envname("LPDEFORM_UPLOAD_IDLE")
      ->check(seconds_from(kLeastSeconds))
      ->capture_default_str();
  app.add_option("--store", arguments.store,
                 "Where sessions are kept so that they outlive the server: sqlite:DIR, a folder of its own; "
                 "redis://HOST:PORT, shared by several servers; none: in memory alone")
      ->envname("LPDEFORM_STORE")
      ->capture_default_str();
  CLI::Option* const user =
      app.add_option("--store-user", arguments.store_options.login.user,
                     "Who the server is to the Redis of --store, where that knows several")
          ->envname("LPDEFORM_STORE_USER");
  app.add_option(
         "--store-password-file", arguments.store_options.login.password_file,
         "A file with the password that the Redis of --store asks for; read again with each connection")
      ->envname("LPDEFORM_STORE_PASSWORD_FILE");
  user->needs("--store-password-file");
  app.add_option("--max-store-bytes", arguments.store_options.most_bytes,
                 "What the folder of --store may hold; as 4GiB or in bytes, 0: as much as the disk has")
      ->envname("LPDEFORM_MAX_STORE_BYTES")
      ->transform(size_in_bytes())
      ->capture_default_str();
  app.add_option("--heartbeat", arguments.heartbeat_seconds,
                 "Seconds of silence after which a stream says something")
      ->envname("LPDEFORM_HEARTBEAT")
      ->check(seconds_from(kLeastSeconds))
      ->capture_default_str();
  app.add_option(
         "--grace", arguments.grace_seconds,
         "Seconds that calls have to end when the server is stopped; a store that fails then has 5 more")
      ->envname("LPDEFORM_GRACE")
      ->check(seconds_from(0))
      ->capture_default_str();
  app.add_option("--log-level", arguments.log_level, "What to log on stderr, one JSON object a line")
      ->envname("LPDEFORM_LOG_LEVEL")
      ->check(CLI::IsMember({"debug", "info", "warning", "error", "off"}))
      ->capture_default_str();
  app.add_option("--healthcheck", arguments.probed,
                 "Asks the server at this address for its health and exits: 0 where it serves, 1 where not; "
                 "http://HOST:PORT asks its admin port, which needs no certificate")
      ->type_name("ADDRESS");
}

/// The name of an option of the service on the command line.
std::string flag_of(std::string name) {
  static const std::map<std::string, std::string> kOthers{{"max_stream_bytes_per_second", "max_stream_rate"},
                                                          {"max_stream_frames_per_second", "max_frame_rate"},
                                                          {"max_upload_bytes_per_second", "max_upload_rate"}};
  if (const auto found = kOthers.find(name); found != kOthers.end()) name = found->second;
  std::replace(name.begin(), name.end(), '_', '-');
  return "--" + name;
}

int refuse(const absl::Status& why) {
  const lpdeform::Fault fault = lpdeform::fault_of(why);
  std::string text = lpdeform::text_for_operators(why);
  if (text.starts_with("Option " + fault.element + " must be"))
    text = flag_of(fault.element) + " must be " + fault.limit + ".";
  std::fprintf(stderr, "lpdeform-server: %s\n", text.c_str());
  return kRefused;
}

/// A request for help ends with status 0; anything else is an error.
int end_of_parse(const CLI::App& app, const CLI::ParseError& error) {
  if (error.get_exit_code() == 0) return app.exit(error);
  std::fprintf(stderr, "lpdeform-server: %s (see lpdeform-server --help)\n", error.what());
  return kRefused;
}

/// Parses text that size_or_percent() has accepted.
lpdeform::ByteLimit byte_limit(const std::string& text) {
  if (const auto percent = percent_of(text)) return {.percent = *percent};
  return {.bytes = std::stoull(text)};
}

int serve(Arguments& arguments, const sigset_t& signals, lpdeform::ProcessEnd& end) {
  ServerOptions& options = arguments.server;
  options.session_idle = milliseconds(arguments.session_idle_seconds);
  options.upload_idle = milliseconds(arguments.upload_idle_seconds);
  options.heartbeat = milliseconds(arguments.heartbeat_seconds);
  options.connection_idle = milliseconds(arguments.connection_idle_seconds);
  options.max_bytes_per_caller = byte_limit(arguments.max_bytes_per_caller);
  options.log = std::make_shared<lpdeform::Log>(arguments.log_level);
  auto store = lpdeform::open_store(arguments.store, arguments.store_options);
  if (!store.ok()) return refuse(store.status());
  options.store = *std::move(store);
  const auto server = lpdeform::Server::start(options);
  if (!server.ok()) return refuse(server.status());
  std::printf("lpdeform-server listens on %s\n", (*server)->address().c_str());
  if (!(*server)->admin_address().empty()) {
    std::printf("lpdeform-server serves its admin pages on http://%s\n", (*server)->admin_address().c_str());
  }
  std::fflush(stdout);
  int signal = 0;
  sigwait(&signals, &signal);
  const auto status = [](bool is_all_kept) { return is_all_kept ? 0 : kNotKept; };
  return status((*server)->drain(milliseconds(arguments.grace_seconds), [&](bool is_all_kept) {
    end.within(is_all_kept ? kToEnd : kToEndWithout, status(is_all_kept), options.log);
  }));
}

const pthread_t main_thread = pthread_self();

void pass_to_main_thread(int signal) {
  pthread_kill(main_thread, signal);
}

// Leaves SIGTERM and SIGINT to sigwait() in the main thread. Threads made from now on block both signals.
// Threads that a library (OpenBLAS) made while it was loaded do not, and they pass the signals on.
sigset_t signals_for_sigwait() {
  sigset_t signals;
  sigemptyset(&signals);
  struct sigaction pass_on = {};
  pass_on.sa_handler = pass_to_main_thread;
  for (const int signal : {SIGTERM, SIGINT}) {
    sigaddset(&signals, signal);
    sigaction(signal, &pass_on, nullptr);
  }
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  return signals;
}

}  // namespace

int main(int argc, char** argv) {
  const sigset_t signals = signals_for_sigwait();
  // Writing beyond a limit on file size then fails, instead of ending the process.
  signal(SIGXFSZ, SIG_IGN);

  lpdeform::ProcessEnd end;  // outlives the store
  Arguments arguments;
  CLI::App app;
  arguments.server.address = "127.0.0.1:50051";
  describe(app, arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return end_of_parse(app, error);
  }
  if (!arguments.probed.empty()) return lpdeform::is_serving(arguments.probed) ? 0 : 1;
  return serve(arguments, signals, end);
}
