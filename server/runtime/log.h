#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <variant>

#include "server/runtime/log_bound.h"

namespace spdlog {
class async_logger;
namespace details {
class thread_pool;
}
}  // namespace spdlog

namespace lpdeform {

/// A field of an event. Never holds a token or coordinates. Left out if its text is empty.
struct LogField {
  using Value = std::variant<std::string, std::uint64_t, double>;
  std::string_view name;
  Value value;
};

/// A number whose field is left out if it is 0, which stands for unknown.
template <typename Number>
LogField::Value where_known(Number number) {
  return number == 0 ? LogField::Value("") : LogField::Value(number);
}

/// Structured log: one JSON object per line on stderr, written by a thread of its own. If that thread cannot
/// keep up, the oldest lines are dropped and a line "lines_lost" gives their number. Calls never wait for the
/// disk.
/// The log takes at most LogBound::kOfASession lines per event, reason and session in kWindow. It counts
/// further ones in a line "left_out", so lines and counts together cover everything. Lines of level debug and
/// of error_each() have no bound. Thread-safe.
class Log {
 public:
  static constexpr std::chrono::seconds kWindow{10};

  /// `level`: "debug", "info", "warning", "error" or "off"; anything else means "info".
  explicit Log(std::string_view level);
  ~Log();

  using Fields = std::initializer_list<LogField>;
  void debug(std::string_view event, Fields fields) const;
  void info(std::string_view event, Fields fields) const;
  void warning(std::string_view event, Fields fields) const;
  void error(std::string_view event, Fields fields) const;

  /// Logs one line for each of many things that no other line names. These lines have no bound. They wait for
  /// room in the queue, up to kStall if it is stuck. Call it only from threads that may wait.
  void error_each(std::string_view event, Fields fields) const;
  static constexpr std::chrono::seconds kStall{1};

  /// Logs how many lines were left out, once kWindow is over. Call it now and then: after a flood there may
  /// be no next line that would do so.
  void sum_up() const;

  /// Writes the queue; later lines are dropped. May wait for the reader of the log.
  void end() const;

 private:
  using Clock = std::chrono::steady_clock;
  void write(int level, std::string_view event, Fields fields) const;
  void write_line(int level, std::string_view event, Fields fields) const;
  void end_window(Clock::time_point now) const;
  bool has_room() const;
  void wait_for_room() const;

  mutable std::shared_ptr<spdlog::details::thread_pool> thread_;  // null after end()
  std::shared_ptr<spdlog::async_logger> logger_;

  mutable std::mutex mutex_;
  mutable LogBound bound_;
  mutable Clock::time_point window_began_ = Clock::now();
  mutable std::size_t lines_lost_ = 0;  // so far
  mutable std::atomic<bool> is_stuck_ = false;
};

/// The first digits of a session's or stream's name: enough to tell names apart, too few to use them.
std::string abbreviated(std::string_view name);

/// Quotes for the log what a caller sent or was told: the first kLongestQuote bytes. Of each long run of
/// hexadecimal digits, which may be a name or a token, only the first digits stay.
std::string in_quotes(std::string_view text);
inline constexpr std::size_t kLongestQuote = 80;

}  // namespace lpdeform
