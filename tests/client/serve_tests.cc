// Servers behind Envoys for a test program of another system, which has remote_server.h:   serve_tests PROGRAM ARGUMENT...
// Runs the program with LPDEFORM_TEST_PORT in its environment, and ends as it does. An argument "@server" is replaced by the
// address of a server of its own. On that port, /open?kind=KIND opens a server and answers with its number and address,
// /QUESTION?id=NUMBER asks it, and /close?id=NUMBER closes it.

#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tests/client/in_process_server.h"
#include "tests/client/lying_server.h"
#include "tests/client/token_server.h"

#include <httplib.h>  // last: its headers define _res, a name that Eigen has

namespace {

using namespace lpdeform::client;

struct Opened {
  std::shared_ptr<const void> server;
  std::string address;
  std::map<std::string, std::function<std::string()>> answers;  // by question
};

Opened open_real(const httplib::Params& told) {
  const auto server =
      std::make_shared<InProcessServer>(told.contains("tls") ? Transport::kTls : Transport::kPlain);
  return {server,
          server->address(),
          {{"roots", [server] { return server->root_certificates(); }},
           {"start", [server] { return server->start_again(), ""; }},
           {"stop", [server] { return server->stop(), ""; }}}};
}

Opened open_with_tokens(const httplib::Params&) {
  const auto server = std::make_shared<TokenServer>();
  return {server, server->address(), {{"token", [server] { return server->token(); }}}};
}

Opened open_lying(const httplib::Params& told) {
  Lies lies;
  for (const auto& [name, number] : told) {
    if (name != "kind") lies[name] = std::stoi(number);
  }
  const auto server = std::make_shared<LyingServer>(lies);
  return {server,
          server->address(),
          {{"stop", [server] { return server->stop(), ""; }},
           {"creations", [server] { return std::to_string(server->creations()); }},
           {"deletions", [server] { return std::to_string(server->deletions()); }},
           {"takings", [server] { return std::to_string(server->takings()); }}}};
}

Opened open_silent(const httplib::Params&) {
  const auto server = std::make_shared<SilentServer>();
  return {server, server->address(), {}};
}

/// Servers by their numbers.
class Servers {
 public:
  std::string open(const httplib::Params& told) {
    static const std::map<std::string, Opened (*)(const httplib::Params&)> kKinds{
        {"real", open_real}, {"tokens", open_with_tokens}, {"lies", open_lying}, {"silence", open_silent}};
    const auto kind = told.find("kind");
    Opened opened = kKinds.at(kind == told.end() ? "real" : kind->second)(told);
    const std::scoped_lock lock(mutex_);
    const std::string id = std::to_string(++count_);
    const std::string said = id + " " + opened.address;
    servers_[id] = std::move(opened);
    return said;
  }
  void close(const std::string& id) {
    const std::scoped_lock lock(mutex_);
    servers_.erase(id);
  }
  std::string ask(const std::string& id, const std::string& question) {
    std::function<std::string()> answer;
    {
      const std::scoped_lock lock(mutex_);
      answer = servers_.at(id).answers.at(question);
    }
    return answer();
  }

 private:
  std::mutex mutex_;
  int count_ = 0;
  std::map<std::string, Opened> servers_;
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
  control.Get("/open",
              [&](const auto& request, auto& response) { text(response, servers.open(request.params)); });
  control.Get("/close", [&](const auto& request, auto&) { servers.close(request.get_param_value("id")); });
  control.Get("/([a-z]+)", [&](const auto& request, auto& response) {
    text(response, servers.ask(request.get_param_value("id"), request.matches[1]));
  });
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
