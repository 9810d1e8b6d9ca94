#pragma once

#include <gtest/gtest.h>

#include <stdlib.h>

#include <filesystem>
#include <memory>
#include <string>

#include "server/server.h"

namespace lpdeform::client {

/// A server on a socket in its own folder. It can be stopped and restarted at the same address.
class InProcessServer {
 public:
  InProcessServer() {
    std::string name = (std::filesystem::temp_directory_path() / "lpdeform-test-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    start_again();
  }

  ~InProcessServer() {
    stop();
    std::filesystem::remove_all(folder_);
  }

  void stop() { server_.reset(); }

  void start_again() {
    ServerOptions options;
    options.address = address();
    options.threads = 2;
    auto server = Server::start(options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  std::string address() const { return "unix:" + (folder_ / "socket").string(); }

 private:
  std::filesystem::path folder_;
  std::unique_ptr<Server> server_;
};

}  // namespace lpdeform::client
