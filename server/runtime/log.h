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

/// A fact of an event. Never a token, never coordinates. Left out where its text is empty.
struct LogField {
  using Value = std::variant<std::string, std::uint64_t, double>;
  std::string_view name;
  Value value;
};

/// A number that is left out where it is 0, because then nobody knows it.
template <typename Number>
LogField::Value where_known(Number number) {
  return number == 0 ? LogField::Value("") : LogField::Value(number);
}

/// Structured log: one JSON object a line on stderr, written by a thread of its own; where that cannot keep
/// up, the oldest lines go, and a line "lines_lost" says how many. Calls never wait for the disk.
///
/// Of one event, reason and session it takes LogBound::kOfASession lines in kWindow; what comes beyond is summed up in a line
/// "left_out", so that lines and counts together are all there was. Lines of level debug and of error_each() have no bound. Thread-safe.
class Log {
 public:
  static constexpr std::chrono::seconds kWindow{10};

  /// `level`: "debug", "info", "warning", "error" or "off"; anything else is "info".
  explicit Log(std::string_view level);
  ~Log();

  using Fields = std::initializer_list<LogField>;
  void debug(std::string_view event, Fields fields) const;
  void info(std::string_view event, Fields fields) const;
  void warning(std::string_view event, Fields fields) const;
  void error(std::string_view event, Fields fields) const;

  /// Of lines that come once, one for each of many things that nobody else names: they have no bound, and wait for room in the queue, up
  /// to kStall of one that is stuck. To be called by threads that may wait.
  void error_each(std::string_view event, Fields fields) const;
  static constexpr std::chrono::seconds kStall{1};

  /// Says what was left out, where kWindow is over. Called now and then: after a flood there may be no next line to do so.
  void sum_up() const;

  /// Writes what waits; lines from now on are none. May wait for whoever reads the log.
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

/// The first digits of a session's or stream's name: enough to tell them apart, too few to use them.
std::string abbreviated(std::string_view name);

/// What a caller sent or is told, for the log: the first kLongestQuote bytes, and of what may be a name or a token, any long run of
/// hexadecimal digits, the first ones.
std::string in_quotes(std::string_view text);
inline constexpr std::size_t kLongestQuote = 80;

}  // namespace lpdeform
