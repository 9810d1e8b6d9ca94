#include "server/admin.h"

#include <httplib.h>

#include <thread>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "server/local_host.h"

namespace lpdeform {
namespace {

constexpr int kThreads = 3;
constexpr int kPatienceSeconds = 5;
constexpr std::size_t kLargestBody = 1024;  // nobody has anything to say to it

/// The port that it listens on; -1 where it cannot.
int bind(httplib::Server& server, const std::string& address) {
  const std::size_t colon = address.rfind(':');
  int port = 0;
  if (colon == std::string::npos || !absl::SimpleAtoi(address.substr(colon + 1), &port)) return -1;
  if (port < 0 || port > 65535) return -1;
  const std::string host = address.substr(0, colon);
  if (port == 0) return server.bind_to_any_port(host);
  return server.bind_to_port(host, port) ? port : -1;
}

}  // namespace

struct Admin::Impl {
  httplib::Server server;
  std::string address;
  std::thread thread;
};

absl::StatusOr<std::unique_ptr<Admin>> Admin::start(const std::string& address,
                                                    const std::map<std::string, Page>& pages) {
  auto impl = std::make_unique<Impl>();
  httplib::Server& server = impl->server;
  server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };
  // As always but for the sharing of ports: one that is taken is an error.
  server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  });
  server.set_read_timeout(kPatienceSeconds);
  server.set_write_timeout(kPatienceSeconds);
  server.set_keep_alive_max_count(1);
  server.set_payload_max_length(kLargestBody);
  if (names_this_machine(address)) {
    server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
      if (names_this_machine(request.get_header_value("Host")))
        return httplib::Server::HandlerResponse::Unhandled;
      response.status = 403;
      response.set_content("The admin port must be called localhost, 127.0.0.1 or [::1].\n", "text/plain");
      return httplib::Server::HandlerResponse::Handled;
    });
  }
  for (const auto& [path, page] : pages) {
    server.Get(path, [page = page](const httplib::Request&, httplib::Response& response) {
      const Answer answer = page();
      response.status = answer.status;
      response.set_content(answer.body, answer.content_type.c_str());
      response.set_header("Cache-Control", "no-store");
    });
  }
  const int port = bind(server, address);
  if (port < 0) {
    return make_fault(absl::StatusCode::kUnavailable, {"ADDRESS_NOT_BOUND", address, ""},
                      absl::StrCat("The admin port cannot listen on ", address, "; is it taken?"));
  }
  impl->address = absl::StrCat(address.substr(0, address.rfind(':')), ":", port);
  impl->thread = std::thread([&server] { server.listen_after_bind(); });
  while (!server.is_running()) std::this_thread::yield();  // before that, stop() would be forgotten
  return std::unique_ptr<Admin>(new Admin(std::move(impl)));
}

Admin::Admin(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

Admin::~Admin() {
  impl_->server.stop();
  impl_->thread.join();
}

const std::string& Admin::address() const {
  return impl_->address;
}

}  // namespace lpdeform
