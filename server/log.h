#pragma once

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

namespace spdlog {
class async_logger;
namespace details {
class thread_pool;
}
}  // namespace spdlog

namespace lpdeform {

/// A fact of an event. Never a token, never coordinates. Left out where its text is empty.
struct LogField {
  std::string_view name;
  std::variant<std::string, std::uint64_t, double> value;
};

/// Structured log: one JSON object a line on stderr, written by a thread of its own; where that cannot keep
/// up, the oldest lines go. Calls never wait for the disk. Thread-safe.
class Log {
 public:
  /// `level`: "debug", "info", "warning", "error" or "off"; anything else is "info".
  explicit Log(std::string_view level);
  ~Log();

  using Fields = std::initializer_list<LogField>;
  void debug(std::string_view event, Fields fields) const;
  void info(std::string_view event, Fields fields) const;
  void warning(std::string_view event, Fields fields) const;

 private:
  void write(int level, std::string_view event, Fields fields) const;

  std::shared_ptr<spdlog::details::thread_pool> thread_;
  std::shared_ptr<spdlog::async_logger> logger_;
};

/// The first digits of a session's or stream's name: enough to tell them apart, too few to use them.
std::string abbreviated(std::string_view name);

}  // namespace lpdeform
