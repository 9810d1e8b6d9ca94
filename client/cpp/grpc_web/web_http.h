#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "client/cpp/client.h"

namespace lpdeform::client {

struct HttpRequest {
  std::string path;  // begins with a slash
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  /// The time that the whole request may take; 0 is without limit.
  std::chrono::milliseconds limit{0};
};

/// What a request does with bytes of its answer.
enum class Taking {
  kTaken,
  kLater,   // there is no room: the same bytes come again after HttpCall::resume()
  kRefused  // the request ends with UNAVAILABLE
};

/// What becomes of a request. All are called on the thread of Http, must not wait, and may start other requests.
struct HttpEvents {
  /// A header of the answer; the name is in lower case. First comes ":status", with the HTTP status. Not kLater.
  std::function<Taking(std::string_view name, std::string_view value)> header;
  /// Bytes of the answer's body.
  std::function<Taking(std::string_view bytes)> bytes;
  /// Last, and once. OK if the whole answer came; UNAVAILABLE if the connection failed, DEADLINE_EXCEEDED after the
  /// limit, CANCELLED after cancel().
  std::function<void(const absl::Status& status)> end;
};

/// A request under way. Thread-safe. It goes on if this object is dropped.
class HttpCall {
 public:
  virtual ~HttpCall() = default;
  virtual void cancel() = 0;
  virtual void resume() = 0;
};

/// Sends POST requests to one HTTP/1.1 server or proxy, each on a connection that is kept for later requests; libcurl
/// and the system's TLS are used here only. One thread works for all requests. Thread-safe.
class Http {
 public:
  /// `origin`: http://HOST:PORT or https://HOST:PORT. `socket`: the path of a Unix socket to connect to instead, if not
  /// empty. `tls`: certificates; if there are none, the system's authorities are trusted.
  static std::shared_ptr<Http> make(std::string origin, std::string socket, std::optional<Tls> tls);
  /// Cancels all requests and waits for the thread. Do not call it from an event.
  virtual ~Http() = default;

  virtual std::shared_ptr<HttpCall> post(HttpRequest request, HttpEvents events) = 0;
};

}  // namespace lpdeform::client
