#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>

namespace lpdeform {

/// Counters: values that only rise.
enum class Count {
  kUpdates,           // taken
  kUpdatesCoalesced,  // superseded by a newer one before the solver saw them
  kFramesPublished,
  kFramesSent,
  kFramesSuperseded,  // published, but not sent to a reader because a newer one came first; counted per reader
  kFrameBytes,        // bytes of the numbers in frames sent
  kCreditStalls,      // a frame had to wait until its reader gave credit back
  kBetterShapes,      // found by the search for lower minima while a session stood, and announced or shown
  kSessionsCreated,
  kConnections,         // taken
  kConnectionsRefused,  // closed because the limit was reached
  kSessionsRestored,    // restored from the store
  kSessionsDamaged,     // not restored, because their stored data cannot be used
  kUpdatesNotKept,      // answered before they were stored, because the store failed or was slow
  kStoreErrors,
};

/// Gauges: values at this moment.
enum class Level {
  kSessions,
  kSessionsMost,
  kStreams,
  kUploads,
  kMemoryBytes,
  kMemoryBytesMost,
  kDraining,
  kOverloaded,
  kStoreFailing,
  kStoreFull,
  kStoreFree,   // bytes left for a store on this machine's disk; 0 with another store
  kStoreLimit,  // of how many bytes in all
  // As Redis reports them; 0 with another store.
  kRedisMemory,
  kRedisMemoryMost,
  kRedisEvicted,
  kRedisClients,
  kRedisClientsRefused,
  kRedisReplicas,
  kRedisSyncsDelayed,
  kRedisInMemoryAlone,
  kRedisPersistenceFailing
};

/// Durations in seconds.
enum class Span {
  kInputToFrame,    // from taking an update to the first frame that answers it
  kInputToSolve,    // the part of that until the solver takes the update over
  kFrameToStream,   // from the publication of a frame until a stream begins to send it
  kFrameEncode,     // of making one message of a frame
  kFrameWrite,      // of one message of a frame: from handing it to gRPC until gRPC takes the next
  kSolve,           // of one solve, from its beginning to its result
  kSetup,           // the part of one solve that factors
  kSchedulerQueue,  // how long a session's slice waits for a thread
  kCallQueue,       // how long a call's task waits for a thread
  kInputToKept,     // from taking an update until it is stored, or until it is answered if that is earlier
  kStoreWrite,      // of one commit to the store
  kStoreRead,       // of one session out of the store
};

/// The service's counters and measurements for Prometheus. Metrics of calls have the names of gRFC A66, with
/// the labels grpc_method ("lpdeform.v1.DeformService/Solve") and grpc_status ("OK"). Metrics of this project
/// begin with lpdeform_. No label value comes from a client. Thread-safe.
class Metrics {
 public:
  Metrics();
  ~Metrics();

  void add(Count what, double by = 1);
  void set(Level what, double value);
  void change(Level what, double by);
  void observe(Span what, double seconds);

  struct Call {
    std::string method;
    std::string status;
    double seconds = 0;
    double sent_bytes = 0;
    double received_bytes = 0;
  };
  void call_started(const std::string& method);
  void call_ended(const Call& call);

  /// `reason`: as in proto/errors.md.
  void rejected(const std::string& reason);
  /// `reason`: "deleted", "expired", "draining" or "elsewhere".
  void session_ended(const std::string& reason);
  /// `reason`: stream_end_name().
  void stream_ended(const std::string& reason);

  /// All of these metrics and those of the process (process_open_fds and so on), in Prometheus's text format
  /// 0.0.4.
  std::string text() const;

 private:
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
