#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "server/runtime/scheduler.h"
#include "server/runtime/task_pool.h"

namespace lpdeform {

/// Liveness and readiness of a server. Each part is tested, not asked. `accepts` opens a new connection to
/// the server's own address, because a listener can die while old connections live on.
class VitalSigns {
 public:
  struct Parts {
    std::function<bool()> accepts;
    std::function<std::uint64_t()> refused;  // connections closed so far because a limit was reached
    std::function<bool()> is_draining;
    Scheduler& scheduler;
    TaskPool& pool;
  };
  explicit VitalSigns(Parts parts) : parts_(std::move(parts)) {}

  struct Finding {
    bool is_draining = false;
    bool takes_connections = false;  // not tested while draining
    bool is_full = false;            // the connection was refused because there are too many
    bool takes_calls = false;        // the task pool ran a task within kPatienceSeconds
    bool runs_sessions = false;      // the scheduler ran a slice within kPatienceSeconds

    /// True also if the server is full: a restart would end the connections that fill it, and all others.
    bool is_alive() const {
      return (is_draining || takes_connections || is_full) && takes_calls && runs_sessions;
    }
    bool is_ready() const { return !is_draining && takes_connections && is_alive(); }
    /// {"status": "serving", "draining", "full" or "failing", "checks": {...}}
    std::string json() const;
  };

  /// Takes up to about 2 kPatienceSeconds. Call it on any thread but those of the parts.
  Finding examine() const;

  static constexpr int kPatienceSeconds = 5;

 private:
  bool runs_task() const;
  bool runs_slice() const;

  const Parts parts_;
};

}  // namespace lpdeform
