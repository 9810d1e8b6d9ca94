#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace lpdeform {

/// One request in plain HTTP/1.1 and its answer, on a connection that then ends. It never blocks: each step
/// handles the bytes that are there. A peer has a fixed time for its whole request, and the same time for the
/// whole answer, even if it sends a few bytes now and then. Only the first line and the host of the request
/// matter. For one thread.
class HttpExchange {
 public:
  using Clock = std::chrono::steady_clock;
  enum class State {
    kReading,
    kAsked,    // path() is known
    kWaiting,  // for answer()
    kWriting,  // writing, then reading until the peer has closed
    kOver,
  };

  /// `fd`: a non-blocking connection, which this object closes. `patience`: for the request, and again for
  /// the answer.
  HttpExchange(int fd, Clock::duration patience);
  ~HttpExchange();
  HttpExchange(const HttpExchange&) = delete;
  HttpExchange& operator=(const HttpExchange&) = delete;

  State state() const { return state_; }
  int fd() const { return fd_; }
  /// The events for poll() that go_on() waits for.
  short events() const;
  /// The deadline of the peer. While the peer waits for the answer, it is never.
  Clock::time_point until() const { return until_; }

  /// Reads or writes what can be read or written now.
  void go_on();

  /// The path of a GET or HEAD, without what follows a question mark; empty for any other request.
  const std::string& path() const { return path_; }
  /// The header "Host"; empty if there is more than one.
  const std::optional<std::string>& host() const { return host_; }
  /// The answer will come later, by answer().
  void wait() { state_ = State::kWaiting; }
  bool is_waited_for() const { return state_ == State::kReading || state_ == State::kWriting; }
  void answer(int status, const std::string& content_type, const std::string& body);

  static constexpr std::size_t kLongestRequest = 8192;

 private:
  void read();
  void write();
  void parse(const std::string& head);
  void refuse(int status);

  const int fd_;
  const Clock::duration patience_;
  State state_ = State::kReading;
  Clock::time_point until_;
  std::string in_, out_, path_;
  std::optional<std::string> host_;
  std::size_t written_ = 0;
  bool is_head_ = false;
};

}  // namespace lpdeform
