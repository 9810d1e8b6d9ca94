#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>

namespace lpdeform {

/// What only ever rises.
enum class Count {
  kUpdates,           // taken
  kUpdatesCoalesced,  // taken, and overtaken by a newer one before the solver saw them
  kFramesPublished,
  kFramesSent,
  kFramesSuperseded,  // published, and never sent to a reader because a newer one came first; once a reader
  kFrameBytes,        // of the numbers in frames sent
  kCreditStalls,      // a reader had to give credit back before it could be sent the frame that waits
  kSessionsCreated,
  kConnections,         // taken
  kConnectionsRefused,  // for want of room
  kSessionsRestored,    // made again from the store
  kSessionsDamaged,     // not made again, because what is stored of them cannot be used
  kUpdatesNotKept,      // answered before they were in the store, which failed or was slow
  kStoreErrors,
};

/// What has a value at each moment.
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
  kStoreFree,   // bytes that a store on this machine's disk has left; 0 with another
  kStoreLimit,  // of which
  // What Redis says of itself; 0 with another store.
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

/// What takes time, in seconds.
enum class Span {
  kInputToFrame,    // from the taking of an update to the first frame that answers it
  kSolve,           // of one solve, from its beginning to its result
  kSetup,           // of one solve: the part that factors
  kSchedulerQueue,  // from being ready to run to running, of a session's slice
  kCallQueue,       // the same of a call's task
  kInputToKept,     // from the taking of an update to its being in the store, or to its earlier answer
  kStoreWrite,      // of one commit to the store
  kStoreRead,       // of one session out of the store
};

/// What the service counts and measures, for Prometheus. The calls have the names of gRFC A66 with the labels
/// grpc_method ("lpdeform.v1.DeformService/Solve") and grpc_status ("OK"); ours begin with lpdeform_. No label has a
/// value that comes from a client. Thread-safe.
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

  /// `reason` as in proto/errors.md.
  void rejected(const std::string& reason);
  /// "deleted", "expired", "draining", "elsewhere".
  void session_ended(const std::string& reason);
  /// `reason`: stream_end_name().
  void stream_ended(const std::string& reason);

  /// All of it and the process's own (process_open_fds and so on), in Prometheus's text format 0.0.4.
  std::string text() const;

 private:
  struct Impl;
  const std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
