#include "server/runtime/process_metrics.h"

#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>

namespace lpdeform {
namespace {

prometheus::MetricFamily family(std::string name, std::string help, prometheus::MetricType type,
                                double value) {
  prometheus::ClientMetric metric;
  if (type == prometheus::MetricType::Counter) {
    metric.counter.value = value;
  } else {
    metric.gauge.value = value;
  }
  return {std::move(name), std::move(help), type, {std::move(metric)}};
}

double entries_of(const char* folder) {
  std::error_code error;
  double count = 0;
  for (auto entry = std::filesystem::directory_iterator(folder, error);
       !error && entry != std::filesystem::directory_iterator(); entry.increment(error)) {
    ++count;
  }
  return count;
}

double most_descriptors() {
  rlimit limit{};
  return getrlimit(RLIMIT_NOFILE, &limit) == 0 ? static_cast<double>(limit.rlim_cur) : 0;
}

double cpu_seconds() {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Reads the second number of /proc/self/statm, which counts pages.
double resident_bytes() {
  std::ifstream file("/proc/self/statm");
  double size = 0, resident = 0;
  file >> size >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE));
}

double unix_seconds_now() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// When this program was loaded; that is close enough to when it was started.
const double start_seconds = unix_seconds_now();

}  // namespace

std::vector<prometheus::MetricFamily> process_metrics() {
  using prometheus::MetricType;
  return {
      family("process_open_fds", "File descriptors open.", MetricType::Gauge,
             entries_of("/proc/self/fd") - 1),
      family("process_max_fds", "File descriptors that may be open.", MetricType::Gauge, most_descriptors()),
      family("process_threads", "Threads.", MetricType::Gauge, entries_of("/proc/self/task")),
      family("process_resident_memory_bytes", "Memory in use as the system counts it.", MetricType::Gauge,
             resident_bytes()),
      family("process_cpu_seconds_total", "Time spent on the cores.", MetricType::Counter, cpu_seconds()),
      family("process_start_time_seconds", "When the process began, since 1970-01-01 UTC.", MetricType::Gauge,
             start_seconds)};
}

}  // namespace lpdeform
