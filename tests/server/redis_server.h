#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "server/redis_connection.h"

namespace lpdeform {

/// A port of this machine that nobody listens on.
inline int free_port() {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  socklen_t size = sizeof(address);
  EXPECT_EQ(getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size), 0);
  close(fd);
  return ntohs(address.sin_port);
}

/// A redis-server of a test's own, which keeps every change on the disk before it answers. Its port is a free one.
class RedisServer {
 public:
  explicit RedisServer(std::string folder) : folder_(std::move(folder)), port_(free_port()) { start(); }
  ~RedisServer() { stop(); }

  int port() const { return port_; }

  /// Starts it, or starts it again with what it has on the disk; returns when it answers.
  void start() {
    std::vector<std::string> words{"redis-server", "--port", std::to_string(port_), "--bind", "127.0.0.1"};
    words.insert(words.end(), {"--dir", folder_, "--logfile", "redis.log", "--save", ""});
    words.insert(words.end(), {"--appendonly", "yes", "--appendfsync", "always"});
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    ASSERT_EQ(posix_spawnp(&pid_, "redis-server", nullptr, nullptr, arguments.data(), environ), 0);
    RedisConnection connection("127.0.0.1", port_, std::chrono::seconds(1));
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
    while (!connection.run({"PING"}).ok()) {
      ASSERT_LT(std::chrono::steady_clock::now(), end) << "redis-server does not answer";
      std::this_thread::sleep_for(std::chrono::milliseconds(5));  // nothing tells when it does
    }
  }

  /// As kill -9 does.
  void stop() {
    if (pid_ == 0) return;
    kill(pid_, SIGCONT);
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

  /// What it has on the disk, to go back to.
  void save_as(const std::string& folder) const {
    std::filesystem::copy(folder_ + "/appendonlydir", folder, std::filesystem::copy_options::recursive);
  }
  /// While it is stopped.
  void go_back_to(const std::string& folder) const {
    lose_all();
    std::filesystem::copy(folder, folder_ + "/appendonlydir", std::filesystem::copy_options::recursive);
  }
  void lose_all() const { std::filesystem::remove_all(folder_ + "/appendonlydir"); }

  void pause() const { kill(pid_, SIGSTOP); }
  void resume() const { kill(pid_, SIGCONT); }

 private:
  const std::string folder_;
  const int port_;
  pid_t pid_ = 0;
};

}  // namespace lpdeform
