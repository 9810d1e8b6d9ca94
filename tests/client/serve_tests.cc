// Servers behind Envoys for a test program of another system, which has remote_server.h:   serve_tests PROGRAM ARGUMENT...
// Runs the program with LPDEFORM_TEST_PORT in its environment, and ends as it does. An argument "@server" is replaced by the
// address of a server of its own.

#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tests/client/in_process_server.h"

#include <httplib.h>  // last: its headers define _res, a name that Eigen has

namespace {

using lpdeform::client::InProcessServer;
using lpdeform::client::Transport;

/// Servers by their numbers.
class Servers {
 public:
  std::string open(Transport transport) {
    auto server = std::make_unique<InProcessServer>(transport);
    const std::scoped_lock lock(mutex_);
    const std::string id = std::to_string(++count_);
    const std::string address = server->address();
    servers_[id] = std::move(server);
    return id + " " + address;
  }
  void close(const std::string& id) {
    const std::scoped_lock lock(mutex_);
    servers_.erase(id);
  }
  InProcessServer& at(const std::string& id) {
    const std::scoped_lock lock(mutex_);
    return *servers_.at(id);
  }

 private:
  std::mutex mutex_;
  int count_ = 0;
  std::map<std::string, std::unique_ptr<InProcessServer>> servers_;
};

int run(char** arguments) {
  const pid_t process = fork();
  if (process == 0) {
    execvp(arguments[0], arguments);
    perror(arguments[0]);
    _exit(127);
  }
  int status = 0;
  waitpid(process, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

int main(int count, char** arguments) {
  if (count < 2) return 2;
  Servers servers;
  httplib::Server control;
  const auto text = [](httplib::Response& response, const std::string& body) {
    response.set_content(body, "text/plain");
  };
  const auto id_of = [](const httplib::Request& request) { return request.get_param_value("id"); };
  control.Get("/open", [&](const auto& request, auto& response) {
    text(response, servers.open(request.has_param("tls") ? Transport::kTls : Transport::kPlain));
  });
  control.Get("/roots", [&](const auto& request, auto& response) {
    text(response, servers.at(id_of(request)).root_certificates());
  });
  control.Get("/close", [&](const auto& request, auto&) { servers.close(id_of(request)); });
  control.Get("/stop", [&](const auto& request, auto&) { servers.at(id_of(request)).stop(); });
  control.Get("/start", [&](const auto& request, auto&) { servers.at(id_of(request)).start_again(); });
  const int port = control.bind_to_any_port("127.0.0.1");
  std::thread serving([&] { control.listen_after_bind(); });
  setenv("LPDEFORM_TEST_PORT", std::to_string(port).c_str(), 1);
  std::unique_ptr<InProcessServer> own;
  std::string address;
  for (int k = 1; k < count; ++k) {
    if (std::string(arguments[k]) != "@server") continue;
    if (!own) own = std::make_unique<InProcessServer>();
    address = own->address();
    arguments[k] = address.data();
  }
  const int status = run(arguments + 1);
  control.stop();
  serving.join();
  return status;
}
