// The operator's pages, and peers that are slow, silent or hostile.

#include "server/admin/admin.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <semaphore>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "core/base/fault.h"
#include "server/admin/http_exchange.h"

namespace lpdeform {
namespace {

constexpr std::chrono::seconds kTestDeadline{120};

/// A connection of this machine's to a port.
class Peer {
 public:
  explicit Peer(const std::string& address) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    int port = 0;
    EXPECT_TRUE(absl::SimpleAtoi(address.substr(address.rfind(':') + 1), &port));
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<in_port_t>(port));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&where), sizeof(where)), 0);
  }
  Peer(Peer&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  ~Peer() {
    if (fd_ >= 0) close(fd_);
  }

  void say(const std::string& bytes) const { send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  /// Neither answered nor closed so far.
  bool is_held() const {
    char byte = 0;
    return recv(fd_, &byte, 1, MSG_DONTWAIT | MSG_PEEK) < 0;
  }
  /// All that comes until the other side ends it.
  std::string heard() const {
    std::string all;
    std::array<char, 4096> buffer;
    for (ssize_t got = 1; got > 0;) {
      got = recv(fd_, buffer.data(), buffer.size(), 0);
      if (got > 0) all.append(buffer.data(), static_cast<std::size_t>(got));
    }
    return all;
  }

 private:
  int fd_;
};

class AdminTest : public testing::Test {
 protected:
  void start(std::chrono::milliseconds patience = kTestDeadline) {
    auto started = Admin::start("127.0.0.1:0",
                                {{"/livez",
                                  [] {
                                    return Admin::Answer{200, "text/plain", "alive"};
                                  }},
                                 {"/slow",
                                  [this] {
                                    ++begun_;
                                    released_.acquire();
                                    return Admin::Answer{200, "text/plain", "made"};
                                  }},
                                 {"/large",
                                  [] {
                                    return Admin::Answer{503, "text/plain", std::string(8 << 20, 'x')};
                                  }}},
                                patience);
    ASSERT_TRUE(started.ok()) << started.status();
    admin_ = *std::move(started);
  }

  /// What a page says; empty where there is no answer.
  std::string get(const std::string& path) const {
    httplib::Client client("http://" + admin_->address());
    client.set_read_timeout(kTestDeadline);
    const auto answer = client.Get(path.c_str());
    return answer ? std::to_string(answer->status) + " " + answer->body : "";
  }

  std::vector<Peer> peers(std::size_t count) const {
    std::vector<Peer> all;
    for (std::size_t k = 0; k < count; ++k) all.emplace_back(admin_->address());
    return all;
  }

  std::atomic<int> begun_ = 0;
  std::counting_semaphore<> released_{0};
  std::unique_ptr<Admin> admin_;
};

TEST_F(AdminTest, AnswersWhileOthersTrickleTheirRequests) {
  start();
  const auto tricklers = peers(64);
  for (const Peer& peer : tricklers) peer.say("GET /livez HTTP/1.1\r\n");
  for (int round = 0; round < 20; ++round) {
    for (const Peer& peer : tricklers) peer.say("x");
    EXPECT_EQ(get("/livez"), "200 alive");
  }
  for (const Peer& peer : tricklers) EXPECT_TRUE(peer.is_held());
}

TEST_F(AdminTest, OfTooManyThatSayNothingTheOldestGoes) {
  start();
  const auto silent = peers(2 * Admin::kMostPatient);
  EXPECT_EQ(get("/livez"), "200 alive");
  EXPECT_EQ(silent.front().heard(), "");
  EXPECT_TRUE(silent.back().is_held());
}

TEST_F(AdminTest, WhoTricklesOnIsClosedAllTheSame) {
  start(std::chrono::milliseconds(300));
  const Peer trickler(admin_->address());
  trickler.say("GET /livez HTTP/1.1\r\n");
  const auto end = std::chrono::steady_clock::now() + kTestDeadline;
  for (std::size_t said = 0; trickler.is_held() && std::chrono::steady_clock::now() < end; ++said) {
    if (said < HttpExchange::kLongestRequest / 2) trickler.say("x");  // within what a request may have
  }
  EXPECT_FALSE(trickler.is_held());
  EXPECT_EQ(trickler.heard(), "");
}

TEST_F(AdminTest, AnswersWhileOthersDoNotReadTheirs) {
  start();
  const auto deaf = peers(16);
  for (const Peer& peer : deaf) peer.say("GET /large HTTP/1.1\r\nHost: localhost\r\n\r\n");
  EXPECT_EQ(get("/large").size(), 4 + (std::size_t{8} << 20));
  EXPECT_EQ(get("/livez"), "200 alive");
  EXPECT_EQ(deaf.front().heard().substr(0, 13), "HTTP/1.1 503 ");
}

TEST_F(AdminTest, APageThatTakesLongHoldsNoOtherUpAndIsMadeForAllWhoWait) {
  start();
  const Peer first(admin_->address());
  first.say("GET /slow HTTP/1.1\r\nHost: localhost\r\n\r\n");
  const auto end = std::chrono::steady_clock::now() + kTestDeadline;
  while (begun_ == 0 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  const auto others = peers(5);
  for (const Peer& peer : others) peer.say("GET /slow?again HTTP/1.1\r\nHost: localhost\r\n\r\n");
  for (int round = 0; round < 3; ++round) EXPECT_EQ(get("/livez"), "200 alive");
  released_.release();
  EXPECT_NE(first.heard().find("made"), std::string::npos);
  while (begun_ == 1 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
  released_.release();
  for (const Peer& peer : others) EXPECT_NE(peer.heard().find("made"), std::string::npos);
  EXPECT_EQ(begun_, 2);
}

TEST_F(AdminTest, WhatIsNoRequestIsRefusedAndHarmsNothing) {
  start();
  const std::vector<std::pair<std::string, std::string>> cases{
      {"\r\n\r\n", "400"},
      {"GET\r\n\r\n", "400"},
      {"GET /livez\r\n\r\n", "400"},
      {"GET  HTTP/1.1\r\nHost: localhost\r\n\r\n", "404"},
      {"GET /livez HTTP/2.0\r\n\r\n", "400"},
      {"POST /livez HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 5\r\n\r\nhello", "404"},
      {"GET /livez HTTP/1.1\r\nHost: example.org\r\n\r\n", "403"},
      {"GET /livez HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n", "403"},
      {"GET /livez HTTP/1.1\r\nHost:\r\n\r\n", "403"},
      {"GET /livez HTTP/1.1\r\n\r\n", "200"},  // no browser's
      {"GET /livez HTTP/1.0\r\n\r\n", "200"},
      {"GET /nothing HTTP/1.1\r\nHost: localhost\r\n\r\n", "404"},
      {std::string(20'000, 'x'), "431"},
      {"GET /livez HTTP/1.1\r\nx: " + std::string(20'000, 'x') + "\r\n\r\n", "431"},
      {std::string(16, '\0') + "\r\n\r\n", "400"},
  };
  for (const auto& [request, status] : cases) {
    const Peer peer(admin_->address());
    peer.say(request);
    EXPECT_EQ(peer.heard().substr(0, 12), "HTTP/1.1 " + status) << request.substr(0, 40);
  }
  const Peer head(admin_->address());
  head.say("HEAD /livez HTTP/1.0\r\nhost: localhost:1\r\n\r\n");
  const std::string said = head.heard();
  EXPECT_NE(said.find("Content-Length: 5\r\n"), std::string::npos);
  EXPECT_EQ(said.find("alive"), std::string::npos);
  EXPECT_EQ(get("/livez"), "200 alive");
}

TEST(Admin, SaysWhichAddressIsTaken) {
  const auto first = Admin::start("127.0.0.1:0", {});
  ASSERT_TRUE(first.ok());
  const auto second = Admin::start((*first)->address(), {});
  EXPECT_EQ(fault_of(second.status()).reason, "ADDRESS_NOT_BOUND");
  EXPECT_NE(second.status().message().find((*first)->address()), std::string::npos);
}

}  // namespace
}  // namespace lpdeform
