#pragma once

#include <gtest/gtest.h>

#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <regex>
#include <string>
#include <thread>
#include <vector>

#include <httplib.h>

#include "tests/client/web_program.h"

namespace lpdeform::client {

/// Whether Envoy has TLS.
enum class Transport { kPlain, kTls };

/// The project's Envoy (deploy/web) in front of one address. It ends with this process.
class WebFront {
 public:
  /// `server`: HOST:PORT, behind it. With TLS, Envoy's certificate has signed itself, for localhost and not 127.0.0.1.
  explicit WebFront(const std::string& server, Transport transport = Transport::kPlain)
      : server_(server), transport_(transport) {
    std::string name = (std::filesystem::temp_directory_path() / "lpdeform-web-XXXXXX").string();
    EXPECT_NE(mkdtemp(name.data()), nullptr);
    folder_ = name;
    const std::string admin = folder_ + "/admin";
    std::vector<std::string> arguments{"web",  "--web",        "127.0.0.1:0",   "--server",
                                       server, "--files",      "none",          "--admin-file",
                                       admin,  "--access-log", folder_ + "/log"};
    if (transport == Transport::kTls) {
      make_certificate();
      arguments.insert(arguments.end(), {"--tls-cert", certificate_file(), "--tls-key", key_file()});
    }
    std::vector<char*> words;
    for (std::string& argument : arguments) words.push_back(argument.data());
    words.push_back(nullptr);
    process_ = fork();
    if (process_ == 0) {
      prctl(PR_SET_PDEATHSIG, SIGTERM);
      execv(kWebProgram, words.data());
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
  /// Where clients connect: http://127.0.0.1:PORT or https://localhost:PORT.
  const std::string& address() const { return address_; }
  /// Envoy's certificate, which signs itself, in PEM; empty without TLS.
  std::string root_certificates() const {
    std::ifstream file(certificate_file());
    return std::string(std::istreambuf_iterator<char>(file), {});
  }

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

  std::string certificate_file() const { return folder_ + "/certificate.pem"; }
  std::string key_file() const { return folder_ + "/key.pem"; }

  /// With RSA: Wine 8 refuses ECDSA signatures where a number has fewer bytes than the key.
  void make_certificate() const {
    const std::string command =
        "openssl req -x509 -newkey rsa:2048 -nodes -days 2 "
        "-subj '/CN=Test of lpdeform' -addext subjectAltName=DNS:localhost -keyout " +
        key_file() + " -out " + certificate_file() + " 2>/dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0) << command;
  }

  void find(const std::string& admin_file) {
    ASSERT_TRUE(eventually([&] {
      std::string admin;
      if (!(std::ifstream(admin_file) >> admin)) return false;
      admin_ = "http://" + admin;
      const auto page = httplib::Client(admin_).Get("/listeners");
      std::smatch found;
      if (!page || !std::regex_search(page->body, found, std::regex("web::(127[.]0[.]0[.]1:([1-9][0-9]*))")))
        return false;
      address_ =
          transport_ == Transport::kTls ? "https://localhost:" + found.str(2) : "http://" + found.str(1);
      return true;
    })) << "deploy/web does not start; deploy/install web brings what it needs";
  }

  const std::string server_;
  const Transport transport_;
  std::string folder_, admin_, address_;
  pid_t process_ = -1;
};

}  // namespace lpdeform::client
