#pragma once

#include <gtest/gtest.h>

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>
#include <string>
#include <thread>

#include <httplib.h>

namespace lpdeform::client {

/// The project's Envoy (deploy/web) in front of one address. It ends with this process.
class WebFront {
 public:
  /// `server`: HOST:PORT, behind it.
  explicit WebFront(const std::string& server) : server_(server) {
    std::string name = (std::filesystem::temp_directory_path() / "lpdeform-web-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    const std::string admin = folder_ + "/admin", log = folder_ + "/log";
    process_ = fork();
    if (process_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      execl(LPDEFORM_DEPLOY_WEB, "web", "--web", "127.0.0.1:0", "--server", server.c_str(), "--files", "none",
            "--admin-file", admin.c_str(), "--access-log", log.c_str(), nullptr);
      _exit(127);
    }
    find(admin);
  }

  ~WebFront() {
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
    std::filesystem::remove_all(folder_);
  }
  WebFront(const WebFront&) = delete;
  WebFront& operator=(const WebFront&) = delete;

  const std::string& server() const { return server_; }
  /// Where clients connect: http://HOST:PORT.
  const std::string& address() const { return address_; }

  /// Waits until Envoy passes calls to the server.
  void wait_for_server() const {
    ASSERT_TRUE(eventually([this] {
      const auto page = httplib::Client(admin_).Get("/clusters");
      const bool is_up = page && page->body.find("::health_flags::healthy") != page->body.npos;
      return is_up;
    })) << "no healthy server at "
        << server_;
  }

 private:
  static bool eventually(const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!holds()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    return true;
  }

  void find(const std::string& admin_file) {
    ASSERT_TRUE(eventually([&] {
      std::string admin;
      if (!(std::ifstream(admin_file) >> admin)) return false;
      admin_ = "http://" + admin;
      const auto page = httplib::Client(admin_).Get("/listeners");
      std::smatch found;
      if (!page || !std::regex_search(page->body, found, std::regex("web::(127[.]0[.]0[.]1:[1-9][0-9]*)")))
        return false;
      address_ = "http://" + found.str(1);
      return true;
    })) << "deploy/web does not start; deploy/install web brings what it needs";
  }

  const std::string server_;
  std::string folder_, admin_, address_;
  pid_t process_ = -1;
};

}  // namespace lpdeform::client
