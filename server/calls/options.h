#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/access/tls_files.h"
#include "server/runtime/log.h"
#include "server/runtime/timers.h"
#include "server/runtime/upload.h"
#include "server/session/session.h"

namespace lpdeform {

class Store;

/// A number of bytes, or a share of another limit.
struct ByteLimit {
  double percent = 50;                    // of that limit; used if `bytes` is not set
  std::optional<std::size_t> bytes = {};  // 0: without limit
};

struct ServerOptions {
  /// "host:port", port 0 for a free one, or "unix:/path/of/socket".
  std::string address = "127.0.0.1:0";

  /// "host:port" of the admin port, with /metrics, /healthz and /livez over plain HTTP; empty: none.
  std::string admin_address = {};

  TlsFiles tls = {};
  /// If set, calls need a bearer token: see Tokens. The file is read again when it changes.
  std::string token_keys_file = {};
  std::string token_issuer = {};
  std::string token_audience = {};
  /// Without tokens and client certificates, every caller who reaches the server is let in. Unless this is
  /// set, the server then accepts only addresses that are reachable from this machine alone.
  bool allow_anonymous = false;

  /// Threads that one solve may use; 0 takes all cores.
  int threads = 0;
  /// Threads that sessions take turns on, at least 2; 0 takes max(4, 2 * cores).
  int runner_threads = 0;

  std::size_t max_connections = 4096;
  std::size_t max_connections_per_address = 1024;  // per peer; 0: without limit; see Listener::Limits
  std::size_t max_sessions = 256;
  std::size_t max_sessions_per_caller = 64;  // if callers are identified; 0: without limit
  std::size_t max_streams_per_caller = 256;  // the same
  std::size_t max_uploads_per_caller = 256;  // the same
  ByteLimit max_bytes_per_caller = {};     // the same, for sessions and uploads; a share is one of max_bytes
  double max_upload_bytes_per_second = 0;  // the same; see CallerLimits
  std::size_t max_streams_per_session = SessionLimits().streams;
  std::size_t max_handles = InputLimits::kMostHandles;  // of one session
  std::size_t max_undo = InputLimits::kMostUndo;        // steps of handles that one session can undo
  std::size_t max_uploads = Uploads::kMostUploads;
  std::size_t max_calls_waiting = 4096;        // for a thread of the pool
  std::size_t max_calls_per_connection = 128;  // at a time; a stream is a call
  std::uint32_t max_vertices = 2'000'000;      // per mesh; three times as many faces
  std::size_t max_bytes = 0;                   // of all sessions and uploads; 0: see default_max_bytes
  std::uint64_t max_upload_bytes = std::uint64_t{256} << 20;  // of one upload

  /// Limit for the frames of one stream; 0: without limit. See StreamOptions::max_bytes_per_second.
  double max_stream_bytes_per_second = 0;
  /// Limit of frames per second of one stream; 0: without limit. A stream that asks for more, or for no
  /// limit, gets this rate.
  double max_stream_frames_per_second = 0;

  std::chrono::milliseconds session_idle = std::chrono::minutes(10);
  std::chrono::milliseconds upload_idle = std::chrono::minutes(10);
  std::chrono::milliseconds heartbeat = std::chrono::seconds(15);
  /// A connection without a call is closed after this time; clients reconnect when they call.
  std::chrono::milliseconds connection_idle = std::chrono::minutes(5);

  /// Where sessions are kept so that they outlive this process; null: in memory alone. See open_store.h.
  std::shared_ptr<Store> store = {};

  /// The clock of sessions, uploads and heartbeats; null: the system's.
  std::shared_ptr<Timers> timers = {};
  /// Null: logs nothing.
  std::shared_ptr<Log> log = {};
};

/// Three quarters of the memory that this process may have: the memory of the machine, or the limit of its
/// control group if that is less.
std::size_t default_max_bytes();

/// One caller's share of max_bytes, which is not 0; 0: without limit.
std::size_t caller_max_bytes(const ServerOptions& options);

}  // namespace lpdeform
