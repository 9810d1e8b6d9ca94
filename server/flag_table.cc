#include <initializer_list>
#include <utility>

#include "server/flags.h"

// Every flag of lpdeform-server; see Flag.

namespace lpdeform {
namespace {

constexpr FlagRange kThreadCount{"0 to 1024", 0, 1024};
constexpr FlagRange kRunnerCount{"0 or 2 to 1024", 2, 1024, true};
constexpr FlagRange kCount{"1 to 10^6", 1, 1e6};
constexpr FlagRange kCountOrNone{"0 to 10^6", 0, 1e6};
constexpr FlagRange kSteps{"0 to 10^4", 0, 1e4};
constexpr FlagRange kVertices{"1 to 10^8", 1, 1e8};
constexpr FlagRange kRates{"finite and >= 0", 0};
constexpr FlagRange kSize{"more than 0", 1};
constexpr FlagRange kShare{"1% to 100%, or a size", 1, 100};
// Clocks count no further.
constexpr FlagRange kSeconds{"0.001 to 1e+09 seconds", 1e-3, 1e9};
constexpr FlagRange kSecondsOrNone{"0 to 1e+09 seconds", 0, 1e9};
// gRPC counts milliseconds in an int.
constexpr FlagRange kConnectionSeconds{"1 to 2e+06 seconds", 1, 2e6};

void append(std::vector<Flag>& flags, std::initializer_list<Flag> more) {
  flags.insert(flags.end(), more);
}

void add_addresses(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(flags,
         {{"address", kAddresses, &server.address,
           "Where to listen: HOST:PORT (port 0: a free one) or unix:/PATH"},
          {"admin-address", kAddresses, &server.admin_address,
           "Where to answer GET /metrics (Prometheus), /healthz (ready) and /livez (alive) over plain HTTP: "
           "HOST:PORT; empty: nowhere"}});
}

void add_access(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(flags,
         {{"tls-cert", kAccess, &server.tls.certificate_chain,
           "Serve with TLS: the certificate chain, in PEM; read again when it changes"},
          {"tls-key", kAccess, &server.tls.private_key, "The certificate's private key, in PEM"},
          {"tls-client-ca", kAccess, &server.tls.client_authorities,
           "Let in only clients with a certificate that one of these signed, in PEM (mutual TLS)"},
          {"token-keys", kAccess, &server.token_keys_file,
           "Let in only callers with a bearer token (JWT) that one of these public keys signed, in PEM; "
           "read again when it changes"},
          {"token-issuer", kAccess, &server.token_issuer, "Required \"iss\" of tokens (any)"},
          {"token-audience", kAccess, &server.token_audience, "Required entry of the tokens' \"aud\" (any)"},
          {"allow-anonymous", kAccess, &server.allow_anonymous,
           "Accept callers from other machines without tokens or client certificates: anyone who reaches "
           "the address may call"}});
}

void add_threads(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(
      flags,
      {{"threads", kThreads, &server.threads, "Threads that one solve may use; 0: all cores", kThreadCount},
       {"runner-threads", kThreads, &server.runner_threads,
        "Threads that sessions take turns on; 0: 4, or twice the cores where that is more", kRunnerCount}});
}

void add_limits_of_connections(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(flags,
         {{"max-connections", kLimits, &server.max_connections,
           "Connections at a time; more are closed at once", kCount},
          {"max-connections-per-address", kLimits, &server.max_connections_per_address,
           "Connections at a time from one address, or one IPv6 network of 64 bits; 0: without limit. "
           "Behind a proxy all come from its address",
           kCountOrNone},
          {"connection-idle", kLimits, &server.connection_idle,
           "Time without a call after which a connection is closed; clients open another when they call. "
           "Calls of the health service and of reflection, which need no token, last no longer",
           kConnectionSeconds},
          {"max-calls-per-connection", kLimits, &server.max_calls_per_connection,
           "Calls on one connection at a time, streams included; more wait in the client", kCount},
          {"max-calls-waiting", kLimits, &server.max_calls_waiting,
           "Calls that may wait for a thread; more are refused", kCount, Reason::kServerBusy}});
}

void add_limits_of_sessions(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(
      flags,
      {{"max-sessions", kLimits, &server.max_sessions, "Sessions at a time", kCount, Reason::kSessionsFull},
       {"max-sessions-per-caller", kLimits, &server.max_sessions_per_caller,
        "Sessions of one caller at a time, where callers are told apart; 0: without limit", kCountOrNone,
        Reason::kCallerSessionsFull},
       {"max-streams-per-session", kLimits, &server.max_streams_per_session,
        "Streams of one session at a time", kCount, Reason::kStreamsFull},
       {"max-streams-per-caller", kLimits, &server.max_streams_per_caller,
        "Streams of one caller's sessions at a time, where callers are told apart; 0: without limit",
        kCountOrNone, Reason::kCallerStreamsFull},
       {"max-handles", kLimits, &server.max_handles, "Handles of one session, and so of one update", kCount,
        Reason::kTooManyHandles},
       {"max-undo", kLimits, &server.max_undo,
        "Steps of its handles that a session can undo, of 1 MiB each and 8 MiB together; the oldest go "
        "first; 0: none",
        kSteps, Reason::kNothingToUndo},
       {"max-vertices", kLimits, &server.max_vertices, "Vertices of one mesh; of faces, three times as many",
        kVertices, Reason::kMeshTooLarge}});
}

void add_limits_of_memory(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(flags,
         {{"max-bytes", kLimits, MemoryValue{&server.max_bytes},
           "Memory for sessions and received uploads, by the server's own count. A size such as 4GiB, or a "
           "share such as 25% of the memory of the machine or control group. 0: 75%",
           kShare, Reason::kMemoryFull},
          {"max-bytes-per-caller", kLimits, &server.max_bytes_per_caller,
           "Memory of one caller's sessions and of what has come of its uploads, where callers are told "
           "apart; as 4GiB, in bytes, or as 25% of --max-bytes; 0: without limit",
           kShare, Reason::kCallerMemoryFull},
          {"max-uploads", kLimits, &server.max_uploads,
           "Uploads at a time. When all are taken, one that is over 10 s old and empty is dropped for a new "
           "one",
           kCount, Reason::kUploadsFull},
          {"max-uploads-per-caller", kLimits, &server.max_uploads_per_caller,
           "Uploads of one caller at a time, where callers are told apart; 0: without limit", kCountOrNone,
           Reason::kCallerUploadsFull},
          {"max-upload-bytes", kLimits, SizeValue{&server.max_upload_bytes},
           "Size of one upload; as 256MiB or in bytes", kSize, Reason::kUploadSize}});
}

void add_limits_of_rates(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(flags,
         {{"max-upload-rate", kLimits, &server.max_upload_bytes_per_second,
           "Bytes a second of one caller's uploads, where callers are told apart, after a burst of 4 MiB or "
           "one second; 0: without limit",
           kRates, Reason::kUploadRate},
          {"max-stream-rate", kLimits, &server.max_stream_bytes_per_second,
           "Bytes per second of one stream's frames. The server lowers the frame rate first, to 10 per "
           "second, then the precision if the client allows it; 0: no limit",
           kRates},
          {"max-frame-rate", kLimits, &server.max_stream_frames_per_second,
           "Frames per second of one stream. The newest are sent, and always the last of an update; 0: no "
           "limit",
           kRates}});
}

void add_limits_of_time(std::vector<Flag>& flags, ServerOptions& server) {
  using enum FlagGroup;
  append(flags, {{"session-idle", kLimits, &server.session_idle,
                  "Time without use after which a session expires", kSeconds, Reason::kSessionUnknown},
                 {"upload-idle", kLimits, &server.upload_idle,
                  "Time without use after which an upload expires", kSeconds, Reason::kUploadUnknown},
                 {"heartbeat", kLimits, &server.heartbeat,
                  "Longest silence of a stream before a heartbeat is sent", kSeconds}});
}

void add_store(std::vector<Flag>& flags, Arguments& arguments) {
  using enum FlagGroup;
  StoreOptions& options = arguments.store_options;
  append(flags,
         {{"store", kStore, &arguments.store,
           "Where sessions are kept so that they outlive the server: sqlite:DIR, a folder of its own; "
           "redis://HOST:PORT, shared by several servers; none: in memory alone"},
          {.name = "store-user",
           .group = kStore,
           .value = &options.login.user,
           .help = "User name for the Redis of --store, if it has users",
           .needs = "store-password-file"},
          {"store-password-file", kStore, &options.login.password_file,
           "A file with the password that the Redis of --store asks for; read again with each connection"},
          {"max-store-bytes",
           kLimits,
           SizeValue{&options.most_bytes},
           "What the folder of --store may hold, its log of 16 MiB included; as 4GiB or in bytes; 0: as much "
           "as the disk has",
           {},
           Reason::kStoreFull}});
}

void add_program(std::vector<Flag>& flags, Arguments& arguments) {
  using enum FlagGroup;
  append(flags,
         {{"grace", kLimits, &arguments.grace,
           "Time for running calls to end after a stop; the store then has 5 s more", kSecondsOrNone,
           Reason::kDraining},
          {.name = "log-level",
           .group = kProgram,
           .value = &arguments.log_level,
           .help = "What to log on stderr, one JSON object a line",
           .choices = {"debug", "info", "warning", "error", "off"}},
          {.name = "healthcheck",
           .group = kProgram,
           .value = &arguments.probed,
           .help = "Asks the server at this address for its health and exits with 0 if it serves and 1 if "
                   "not; http://HOST:PORT asks its admin port, which needs no certificate",
           .type = "ADDRESS",
           .is_in_environment = false}});
}

}  // namespace

std::vector<Flag> flags_of(ServerOptions& options) {
  std::vector<Flag> flags;
  for (const auto add :
       {add_addresses, add_access, add_threads, add_limits_of_connections, add_limits_of_sessions,
        add_limits_of_memory, add_limits_of_rates, add_limits_of_time})
    add(flags, options);
  return flags;
}

std::vector<Flag> flags_of(Arguments& arguments) {
  std::vector<Flag> flags = flags_of(arguments.server);
  add_store(flags, arguments);
  add_program(flags, arguments);
  return flags;
}

}  // namespace lpdeform
