// What gRPC-Web calls make of an answer that is meant to harm the client.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "client/cpp/grpc_web/grpc_web.h"
#include "client/cpp/grpc_web/web_calls.h"
#include "client/cpp/grpc_web/web_deform_call.h"
#include "client/cpp/grpc_web/web_inbox.h"
#include "client/cpp/rpc.h"

namespace lpdeform::client {
namespace {

constexpr char kHead[] = "HTTP/1.1 200 OK\r\ncontent-type: application/grpc-web+proto\r\n";

/// Answers each request with `start`, and then with `more` again and again until the client hangs up.
class HostileProxy {
 public:
  HostileProxy(std::string start, std::string more) : start_(std::move(start)), more_(std::move(more)) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    at.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(bind(listening_, reinterpret_cast<sockaddr*>(&at), sizeof at), 0);
    EXPECT_EQ(listen(listening_, 8), 0);
    socklen_t size = sizeof at;
    getsockname(listening_, reinterpret_cast<sockaddr*>(&at), &size);
    origin_ = "http://127.0.0.1:" + std::to_string(ntohs(at.sin_port));
    thread_ = std::thread([this] { run(); });
  }
  ~HostileProxy() {
    is_over_ = true;
    shutdown(listening_, SHUT_RDWR);
    thread_.join();
    close(listening_);
  }
  HostileProxy(const HostileProxy&) = delete;
  HostileProxy& operator=(const HostileProxy&) = delete;

  const std::string& origin() const { return origin_; }
  std::size_t bytes_sent() const { return bytes_sent_; }

 private:
  void run() {
    while (!is_over_) {
      const int connection = accept(listening_, nullptr, nullptr);
      if (connection < 0) return;
      const timeval pause{.tv_sec = 0, .tv_usec = 20'000};  // so that the end of the test is noticed
      setsockopt(connection, SOL_SOCKET, SO_SNDTIMEO, &pause, sizeof pause);
      char request[4096];
      (void)recv(connection, request, sizeof request, 0);
      bool goes_on = put(connection, start_);
      while (goes_on && !is_over_) {
        if (more_.empty()) {
          setsockopt(connection, SOL_SOCKET, SO_RCVTIMEO, &pause, sizeof pause);
          const ssize_t count = recv(connection, request, sizeof request, 0);
          goes_on = count > 0 || (count < 0 && errno == EAGAIN);
        } else {
          goes_on = put(connection, more_);
        }
      }
      close(connection);
    }
  }

  bool put(int connection, std::string_view bytes) {
    while (!bytes.empty() && !is_over_) {
      const ssize_t count = send(connection, bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (count < 0 && errno != EAGAIN) return false;
      if (count < 0) continue;
      bytes.remove_prefix(static_cast<std::size_t>(count));
      bytes_sent_ += static_cast<std::size_t>(count);
    }
    return true;
  }

  const std::string start_, more_;
  const int listening_ = socket(AF_INET, SOCK_STREAM, 0);
  std::string origin_;
  std::atomic<bool> is_over_ = false;
  std::atomic<std::size_t> bytes_sent_ = 0;
  std::thread thread_;
};

std::string repeated(const std::string& text, int count) {
  std::string out;
  for (int k = 0; k < count; ++k) out += text;
  return out;
}

std::string trailers(const std::string& block) {
  std::string frame = framed(block);
  frame[0] = '\x80';
  return frame;
}

/// How a call ends that has `limit` of time.
absl::Status end_of_call(const HostileProxy& proxy,
                         std::chrono::milliseconds limit = std::chrono::minutes(1)) {
  const auto http = Http::make(proxy.origin(), "", std::nullopt);
  return Calls(*http, Caller()).wait("GetSession", v1::GetSessionRequest(), limit, {}).status();
}

// These end at once: the proxy goes on for as long as the client listens, and the call may take a minute.

TEST(HostileProxy, AHugeLengthEndsTheCall) {
  const HostileProxy proxy(kHead + std::string("\r\n") + std::string("\0\xff\xff\xff\xff", 5),
                           repeated("x", 1000));
  EXPECT_EQ(end_of_call(proxy).code(), absl::StatusCode::kResourceExhausted);
}

TEST(HostileProxy, HeadersWithoutEndEndTheCall) {
  const HostileProxy proxy(kHead, "x-header: value\r\n");
  EXPECT_EQ(end_of_call(proxy).code(), absl::StatusCode::kResourceExhausted);
}

TEST(HostileProxy, ALineOfAHeaderWithoutEndEndsTheCall) {
  const HostileProxy proxy(kHead + std::string("x-header: "), repeated("x", 1000));
  EXPECT_FALSE(end_of_call(proxy).ok());
}

TEST(HostileProxy, HeadersAfterTheBodyWithoutEndEndTheCall) {
  const HostileProxy proxy(kHead + std::string("transfer-encoding: chunked\r\n\r\n0\r\n"),
                           "x-header: value\r\n");
  EXPECT_EQ(end_of_call(proxy).code(), absl::StatusCode::kResourceExhausted);
}

TEST(HostileProxy, TrailersOfMegabytesEndTheCall) {
  const HostileProxy proxy(kHead + std::string("\r\n") + trailers(std::string(1 << 20, 'x')), "");
  EXPECT_EQ(end_of_call(proxy).code(), absl::StatusCode::kResourceExhausted);
}

TEST(HostileProxy, MessagesAfterTheTrailersEndTheCall) {
  const std::string end = trailers("grpc-status: 0\r\n");
  const HostileProxy proxy(kHead + std::string("\r\n") + framed("") + end, end);
  EXPECT_EQ(end_of_call(proxy).code(), absl::StatusCode::kInternal);
}

TEST(HostileProxy, APageWithoutEndEndsTheCall) {
  const HostileProxy proxy("HTTP/1.1 200 OK\r\ncontent-type: text/html\r\n\r\n", repeated("<p>", 1000));
  EXPECT_EQ(end_of_call(proxy).code(), absl::StatusCode::kResourceExhausted);
}

TEST(HostileProxy, MessagesWithoutEndTakeNoLongerThanTheCallMayTake) {
  const HostileProxy proxy(kHead + std::string("\r\n"), repeated(framed(""), 1000));
  EXPECT_EQ(end_of_call(proxy, std::chrono::milliseconds(300)).code(), absl::StatusCode::kDeadlineExceeded);
}

TEST(HostileProxy, AnAnswerThatStopsTakesNoLongerThanTheCallMayTake) {
  for (const std::string& start :
       {std::string(), std::string(kHead), kHead + std::string("\r\n") + framed("xyz").substr(0, 6)}) {
    const HostileProxy proxy(start, "");
    EXPECT_EQ(end_of_call(proxy, std::chrono::milliseconds(300)).code(), absl::StatusCode::kDeadlineExceeded);
  }
}

TEST(HostileProxy, AClientWithoutCallsEndsAtOnce) {
  const HostileProxy proxy("", "");
  const auto start = std::chrono::steady_clock::now();
  for (int k = 0; k < 20; ++k) {
    const auto http = Http::make(proxy.origin(), "", std::nullopt);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));  // its thread waits by now
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10));  // half a second each
}

TEST(HostileProxy, AStreamOfEmptyMessagesThatNobodyTakesIsHeldBack) {
  const HostileProxy proxy(kHead + std::string("\r\n"), repeated(framed(""), 1000));
  const std::unique_ptr<DeformCall> call =
      deform_by_web(Http::make(proxy.origin(), "", std::nullopt), Caller(), std::chrono::minutes(1));
  v1::DeformRequest request;
  request.mutable_open()->set_session("sessions/1");
  ASSERT_TRUE(call->write(request));
  std::size_t sent = 0;
  for (int still = 0; still < 10; std::this_thread::sleep_for(std::chrono::milliseconds(50))) {
    still = sent > 0 && proxy.bytes_sent() == sent ? still + 1 : 0;
    sent = proxy.bytes_sent();
    ASSERT_LT(sent, std::size_t{64} << 20);
  }
  v1::DeformResponse response;
  EXPECT_TRUE(call->read(response));
}

}  // namespace
}  // namespace lpdeform::client
