#include "server/access/listener.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <condition_variable>
#include <mutex>
#include <string>
#include <vector>

#include "core/base/fault.h"

namespace lpdeform {
namespace {

/// A TCP connection to a port of this machine, from one of its loopback addresses.
class Connection {
 public:
  explicit Connection(const std::string& address, in_addr_t from = INADDR_LOOPBACK)
      : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl(from);
    EXPECT_EQ(bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof(own)), 0);
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<in_port_t>(std::stoi(address.substr(address.rfind(':') + 1))));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(fd_, reinterpret_cast<const sockaddr*>(&where), sizeof(where)), 0);
  }
  ~Connection() { close(fd_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Whether the other side closes it, or has, before so much time has passed.
  bool is_closed_by_other(std::chrono::milliseconds patience) const {
    pollfd ready{fd_, POLLIN, 0};
    char byte = 0;
    return poll(&ready, 1, static_cast<int>(patience.count())) == 1 && recv(fd_, &byte, 1, 0) <= 0;
  }

 private:
  const int fd_;
};

class ListenerTest : public testing::Test {
 protected:
  ~ListenerTest() override {
    if (listener_) listener_->stop();
    for (const int fd : taken_) close(fd);
  }

  void start(const std::string& address, std::size_t most, std::size_t per_address = 0) {
    auto bound = Listener::bind(address);
    ASSERT_TRUE(bound.ok()) << bound.status();
    listener_ = *std::move(bound);
    listener_->start({most, per_address}, {[this](int, int fd) {
                                             const std::scoped_lock lock(mutex_);
                                             taken_.push_back(fd);
                                             changed_.notify_all();
                                           },
                                           [] {}});
  }

  bool has_taken(std::size_t count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, std::chrono::minutes(1), [&] { return taken_.size() >= count; });
  }

  void release_all() {
    const std::scoped_lock lock(mutex_);
    for (const int fd : taken_) close(fd);
    taken_.clear();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<int> taken_;
  std::unique_ptr<Listener> listener_;
};

TEST_F(ListenerTest, TakesNoMoreThanItMayAndAgainWhenOthersHaveGone) {
  start("127.0.0.1:0", 2);
  std::vector<std::unique_ptr<Connection>> kept;
  for (std::uint64_t round = 0; round < 3; ++round) {
    // Who has gone is counted now and then: until then a new one is turned away.
    while (listener_->accepted() < 2 * round + 2) {
      auto connection = std::make_unique<Connection>(listener_->address());
      if (!connection->is_closed_by_other(std::chrono::milliseconds(10)))
        kept.push_back(std::move(connection));
    }
    ASSERT_TRUE(has_taken(2));
    EXPECT_TRUE(Connection(listener_->address()).is_closed_by_other(std::chrono::minutes(1)));
    release_all();
  }
  EXPECT_EQ(listener_->accepted(), 6u);
}

TEST_F(ListenerTest, LetsNoAddressTakeThePlacesOfOthers) {
  start("127.0.0.1:0", 4, 2);
  std::vector<std::unique_ptr<Connection>> kept;
  for (int k = 0; k < 2; ++k) kept.push_back(std::make_unique<Connection>(listener_->address()));
  ASSERT_TRUE(has_taken(2));
  EXPECT_TRUE(Connection(listener_->address()).is_closed_by_other(std::chrono::minutes(1)));
  kept.push_back(std::make_unique<Connection>(listener_->address(), INADDR_LOOPBACK + 1));  // 127.0.0.2
  ASSERT_TRUE(has_taken(3));
  release_all();
  while (listener_->accepted() < 4) {
    auto connection = std::make_unique<Connection>(listener_->address());
    if (!connection->is_closed_by_other(std::chrono::milliseconds(10))) kept.push_back(std::move(connection));
  }
  EXPECT_TRUE(has_taken(1));
}

TEST_F(ListenerTest, KnowsWhatOnlyThisMachineReaches) {
  for (const char* const local : {"127.0.0.1:0", "127.9.9.9:0"}) {
    EXPECT_TRUE((*Listener::bind(local))->is_local()) << local;
  }
  EXPECT_FALSE((*Listener::bind("0.0.0.0:0"))->is_local());
  EXPECT_TRUE((*Listener::bind("unix:/tmp/lpdeform-listener-" + std::to_string(getpid())))->is_local());
}

TEST_F(ListenerTest, SaysWhatIsWrongWithAnAddress) {
  const auto taken = Listener::bind("127.0.0.1:0");
  ASSERT_TRUE(taken.ok());
  for (const std::string& wrong :
       {(*taken)->address(), std::string("nowhere"), std::string("127.0.0.1:99999"),
        std::string("127.0.0.1:http"), std::string("name.invalid:1"), std::string("192.0.2.1:0"),
        std::string("unix:"), std::string("unix:/no/such/folder/s"), "unix:/" + std::string(200, 'x')}) {
    const auto refused = Listener::bind(wrong);
    ASSERT_FALSE(refused.ok()) << wrong;
    EXPECT_EQ(fault_of(refused.status()).reason, "ADDRESS_NOT_BOUND");
    EXPECT_NE(refused.status().message().find(wrong), std::string::npos) << refused.status();
  }
}

TEST_F(ListenerTest, StopsWhenAskedTo) {
  start("127.0.0.1:0", 10);
  const std::string address = listener_->address();
  listener_->stop();
  listener_->stop();
  EXPECT_TRUE(Listener::bind(address).ok());
}

}  // namespace
}  // namespace lpdeform
