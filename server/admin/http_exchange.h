#pragma once

#include <chrono>
#include <cstddef>
#include <optional>
#include <string>

namespace lpdeform {

/// One request in plain HTTP/1.1 and its answer, on a connection that ends with them. It waits for nobody: each step takes what
/// is there, and a peer that is slow has a fixed time for its whole request, and again for the whole answer, whatever it
/// trickles meanwhile. Of the request only the first line and the host count. For one thread.
class HttpExchange {
 public:
  using Clock = std::chrono::steady_clock;
  enum class State {
    kReading,
    kAsked,    // path() is known
    kWaiting,  // for answer()
    kWriting,  // and then reading on until the peer has seen the end
    kOver,
  };

  /// `fd`: a connection that does not block, which it closes. `patience`: for the request, and for the answer.
  HttpExchange(int fd, Clock::duration patience);
  ~HttpExchange();
  HttpExchange(const HttpExchange&) = delete;
  HttpExchange& operator=(const HttpExchange&) = delete;

  State state() const { return state_; }
  int fd() const { return fd_; }
  /// For poll(): what go_on() waits for.
  short events() const;
  /// By then the peer has to have done its part. Never, while it is the one that waits.
  Clock::time_point until() const { return until_; }

  /// Reads or writes what can be read or written now.
  void go_on();

  /// Of a GET or HEAD, without what follows a question mark; empty for any other request.
  const std::string& path() const { return path_; }
  /// The header "Host"; empty where there is more than one.
  const std::optional<std::string>& host() const { return host_; }
  /// Somebody is to answer it later.
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
