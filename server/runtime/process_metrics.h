#pragma once

#include <prometheus/metric_family.h>

#include <vector>

namespace lpdeform {

/// What Linux reports of this process now, under the names that Prometheus's client libraries use:
/// process_open_fds, process_max_fds, process_threads, process_resident_memory_bytes,
/// process_cpu_seconds_total, process_start_time_seconds.
std::vector<prometheus::MetricFamily> process_metrics();

}  // namespace lpdeform
