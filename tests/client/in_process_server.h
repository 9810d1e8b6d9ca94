#pragma once

#include <gtest/gtest.h>

#include <stdlib.h>

#include <filesystem>
#include <memory>
#include <string>
#include <utility>

#include "server/server.h"
#ifdef LPDEFORM_OVER_WEB
#include "tests/client/web_front.h"
#endif

namespace lpdeform::client {

/// A server on a socket in its own folder. It can be stopped and restarted at the same address. In programs that test
/// gRPC-Web, it has a port instead, and clients reach it through the project's Envoy.
class InProcessServer {
 public:
#ifdef LPDEFORM_OVER_WEB
  explicit InProcessServer(Transport transport = Transport::kPlain)
      : InProcessServer(ServerOptions(), transport) {}

  explicit InProcessServer(ServerOptions options, Transport transport = Transport::kPlain)
      : options_(std::move(options)) {
    start_again();
    if (!server_) return;
    front_ = std::make_unique<WebFront>(server_->address(), transport);
    front_->wait_for_server();
  }

  /// Those that a client has to trust, in PEM; empty without TLS.
  std::string root_certificates() const {
    return front_->root_certificates();
  }

  std::string address() const {
    return front_->address();
  }
#else
  explicit InProcessServer(ServerOptions options = {}) : options_(std::move(options)) {
    std::string name = (std::filesystem::temp_directory_path() / "lpdeform-test-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    start_again();
  }

  ~InProcessServer() {
    stop();
    std::filesystem::remove_all(folder_);
  }

  std::string address() const {
    return "unix:" + (folder_ / "socket").string();
  }
#endif

  void stop() {
    server_.reset();
  }

  void start_again() {
    options_.address = listening();
    options_.threads = 2;
    auto server = Server::start(options_);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

 private:
  ServerOptions options_;
#ifdef LPDEFORM_OVER_WEB
  std::string listening() const {
    return front_ ? front_->server() : "127.0.0.1:0";
  }
  std::unique_ptr<Server> server_;
  std::unique_ptr<WebFront> front_;
#else
  std::string listening() const {
    return address();
  }
  std::filesystem::path folder_;
  std::unique_ptr<Server> server_;
#endif
};

}  // namespace lpdeform::client
