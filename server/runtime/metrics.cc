#include "server/runtime/metrics.h"

#include <prometheus/counter.h>
#include <prometheus/gauge.h>
#include <prometheus/histogram.h>
#include <prometheus/registry.h>
#include <prometheus/text_serializer.h>

#include <sstream>
#include <vector>

#include "server/runtime/process_metrics.h"
#include "server/runtime/stream_ends.h"

namespace lpdeform {
namespace {

using prometheus::Counter;
using prometheus::Family;
using prometheus::Gauge;
using prometheus::Histogram;
using Buckets = Histogram::BucketBoundaries;

struct Entry {
  const char* name;
  const char* help;
};

// In the order of the enums.
constexpr std::array kCounts{
    Entry{"lpdeform_updates_total", "Updates taken."},
    Entry{"lpdeform_updates_coalesced_total",
          "Updates superseded by a newer one before the solver saw them."},
    Entry{"lpdeform_frames_published_total", "Frames that solvers published."},
    Entry{"lpdeform_frames_sent_total", "Frames that the server began to send, counted per reader."},
    Entry{"lpdeform_frames_superseded_total",
          "Frames never sent to a reader because a newer one came first."},
    Entry{"lpdeform_frame_bytes_total", "Bytes of positions, distortion and normals in frames sent."},
    Entry{"lpdeform_credit_stalls_total", "How often a frame had to wait for a reader's credit."},
    Entry{"lpdeform_better_shapes_total", "Shapes of lower energy that were found while a session stood."},
    Entry{"lpdeform_sessions_created_total", "Sessions made."},
    Entry{"lpdeform_connections_total", "Connections taken."},
    Entry{"lpdeform_connections_refused_total", "Connections closed at once because of --max-connections."},
    Entry{"lpdeform_sessions_restored_total", "Sessions restored from the store."},
    Entry{"lpdeform_sessions_damaged_total",
          "Failed tries to restore a session because its stored data cannot be used."},
    Entry{"lpdeform_updates_not_kept_total",
          "Updates answered before they were stored, because the store failed or was slow."},
    Entry{"lpdeform_store_errors_total", "Operations of the store that failed."},
};
constexpr std::array kLevels{
    Entry{"lpdeform_sessions", "Sessions held."},
    Entry{"lpdeform_sessions_limit", "Sessions that may be held (--max-sessions)."},
    Entry{"lpdeform_streams", "Open streams of frames."},
    Entry{"lpdeform_uploads", "Uploads held."},
    Entry{"lpdeform_memory_bytes", "Memory of sessions and uploads by the server's own count."},
    Entry{"lpdeform_memory_limit_bytes", "Memory that sessions and uploads may use (--max-bytes)."},
    Entry{"lpdeform_draining", "1 while the server shuts down."},
    Entry{"lpdeform_overloaded", "1 while sessions wait too long for a thread and frames come less often."},
    Entry{"lpdeform_store_failing", "1 while the store does not take changes."},
    Entry{"lpdeform_store_full", "1 while the store has no room for new data; it still removes."},
    Entry{"lpdeform_store_free_bytes",
          "Bytes left for --store sqlite:DIR, on its disk or of --max-store-bytes."},
    Entry{"lpdeform_store_limit_bytes",
          "All bytes of that disk or limit, free or used; 0 with another store."},
    Entry{"lpdeform_redis_memory_bytes", "Memory of Redis. All lpdeform_redis_* are as Redis reports them."},
    Entry{"lpdeform_redis_memory_limit_bytes", "The maxmemory of Redis; 0: none."},
    Entry{"lpdeform_redis_evicted_keys", "Keys that Redis evicted since it was started."},
    Entry{"lpdeform_redis_clients", "Connections of Redis."},
    Entry{"lpdeform_redis_clients_refused", "Connections that Redis refused since it was started."},
    Entry{"lpdeform_redis_replicas", "Replicas connected to Redis."},
    Entry{"lpdeform_redis_syncs_delayed",
          "Writes of Redis to its disk that waited for over 2 s, since it was started."},
    Entry{"lpdeform_redis_in_memory_alone", "1 if Redis keeps nothing on a disk (appendonly no)."},
    Entry{"lpdeform_redis_persistence_failing", "1 while the append-only log of Redis fails."},
};
constexpr std::array kSpans{
    Entry{"lpdeform_input_to_frame_seconds",
          "From taking an update to the first frame that answers it, if a stream is open."},
    Entry{"lpdeform_input_to_solve_seconds", "The part of that until the solver takes the update over."},
    Entry{"lpdeform_frame_to_stream_seconds",
          "From the publication of a frame until a stream begins to send it: its credit, its pace and its "
          "turn."},
    Entry{"lpdeform_frame_encode_seconds",
          "Duration of making a message of a frame, on a stream of one session."},
    Entry{"lpdeform_frame_write_seconds",
          "From handing a message of a frame to gRPC until gRPC takes the next one."},
    Entry{"lpdeform_solve_seconds", "Duration of finished solves."},
    Entry{"lpdeform_setup_seconds", "Time that finished solves spent factoring."},
    Entry{"lpdeform_scheduler_queue_seconds", "From when a session is ready to run until it runs."},
    Entry{"lpdeform_call_queue_seconds", "From a call's arrival until a thread works on it."},
    Entry{"lpdeform_input_to_kept_seconds",
          "From taking an update until it is stored, or until its answer if that came first."},
    Entry{"lpdeform_store_write_seconds", "Duration of commits to the store."},
    Entry{"lpdeform_store_read_seconds", "Duration of reading a session from the store."},
};

/// The buckets of gRFC A66.
const Buckets& call_seconds() {
  static const Buckets buckets{
      0,    0.00001, 0.00005, 0.0001, 0.0003, 0.0006, 0.0008, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.008,
      0.01, 0.013,   0.016,   0.02,   0.025,  0.03,   0.04,   0.05,  0.065, 0.08,  0.1,   0.13,  0.16,  0.2,
      0.25, 0.3,     0.4,     0.5,    0.65,   0.8,    1,      2,     5,     10,    20,    50,    100};
  return buckets;
}

const Buckets& call_bytes() {
  static const Buckets buckets{0,       1024,    2048,     4096,     16384,     65536,      262144,
                               1048576, 4194304, 16777216, 67108864, 268435456, 1073741824, 4294967296};
  return buckets;
}

/// From a fifth of a frame at 60 Hz up to waits that nobody would accept.
const Buckets& our_seconds() {
  static const Buckets buckets{0.0001, 0.0002, 0.0005, 0.001, 0.002, 0.004, 0.008, 0.016, 0.033, 0.05, 0.075,
                               0.1,    0.15,   0.25,   0.5,   1,     2,     5,     10,    30,    60,   300};
  return buckets;
}

template <typename Metric>
Family<Metric>& family(prometheus::Registry& registry, const char* name, const char* help) {
  if constexpr (std::is_same_v<Metric, Counter>) {
    return prometheus::BuildCounter().Name(name).Help(help).Register(registry);
  } else if constexpr (std::is_same_v<Metric, Gauge>) {
    return prometheus::BuildGauge().Name(name).Help(help).Register(registry);
  } else {
    return prometheus::BuildHistogram().Name(name).Help(help).Register(registry);
  }
}

}  // namespace

struct Metrics::Impl {
  Impl() {
    for (const Entry& entry : kCounts)
      counts.push_back(&family<Counter>(registry, entry.name, entry.help).Add({}));
    for (const Entry& entry : kLevels)
      levels.push_back(&family<Gauge>(registry, entry.name, entry.help).Add({}));
    for (const Entry& entry : kSpans)
      spans.push_back(&family<Histogram>(registry, entry.name, entry.help).Add({}, our_seconds()));
    for (const StreamEnd end : kStreamEnds) streams_ended.Add({{"reason", stream_end_name(end)}});
  }

  prometheus::Registry registry;
  std::vector<Counter*> counts;
  std::vector<Gauge*> levels;
  std::vector<Histogram*> spans;
  Family<Counter>& started =
      family<Counter>(registry, "grpc_server_call_started_total", "Calls started, finished or not.");
  Family<Histogram>& duration = family<Histogram>(registry, "grpc_server_call_duration_seconds",
                                                  "Duration of calls, from their arrival to their status.");
  Family<Histogram>& sent =
      family<Histogram>(registry, "grpc_server_call_sent_total_compressed_message_size_bytes",
                        "Bytes of messages sent, by call; gRPC compresses nothing.");
  Family<Histogram>& received =
      family<Histogram>(registry, "grpc_server_call_rcvd_total_compressed_message_size_bytes",
                        "Bytes of messages received, by call; gRPC compresses nothing.");
  Family<Counter>& rejections = family<Counter>(
      registry, "lpdeform_rejections_total", "Calls and updates refused, by the reason of proto/errors.md.");
  Family<Counter>& sessions_ended =
      family<Counter>(registry, "lpdeform_sessions_ended_total", "Sessions ended, by reason.");
  Family<Counter>& streams_ended =
      family<Counter>(registry, "lpdeform_streams_ended_total", "Streams of frames ended, by reason.");
};

Metrics::Metrics() : impl_(std::make_unique<Impl>()) {}
Metrics::~Metrics() = default;

void Metrics::add(Count what, double by) {
  impl_->counts[static_cast<std::size_t>(what)]->Increment(by);
}

void Metrics::set(Level what, double value) {
  impl_->levels[static_cast<std::size_t>(what)]->Set(value);
}

void Metrics::change(Level what, double by) {
  impl_->levels[static_cast<std::size_t>(what)]->Increment(by);
}

void Metrics::observe(Span what, double seconds) {
  impl_->spans[static_cast<std::size_t>(what)]->Observe(seconds);
}

void Metrics::call_started(const std::string& method) {
  impl_->started.Add({{"grpc_method", method}}).Increment();
}

void Metrics::call_ended(const Call& call) {
  const std::map<std::string, std::string> labels{{"grpc_method", call.method}, {"grpc_status", call.status}};
  impl_->duration.Add(labels, call_seconds()).Observe(call.seconds);
  impl_->sent.Add(labels, call_bytes()).Observe(call.sent_bytes);
  impl_->received.Add(labels, call_bytes()).Observe(call.received_bytes);
}

void Metrics::rejected(const std::string& reason) {
  impl_->rejections.Add({{"reason", reason}}).Increment();
}

void Metrics::session_ended(const std::string& reason) {
  impl_->sessions_ended.Add({{"reason", reason}}).Increment();
}

void Metrics::stream_ended(const std::string& reason) {
  impl_->streams_ended.Add({{"reason", reason}}).Increment();
}

std::string Metrics::text() const {
  std::vector<prometheus::MetricFamily> all = impl_->registry.Collect();
  for (prometheus::MetricFamily& family : process_metrics()) all.push_back(std::move(family));
  std::ostringstream out;
  prometheus::TextSerializer().Serialize(out, all);
  return out.str();
}

}  // namespace lpdeform
