#include "tests/client/remote_server.h"

#include <gtest/gtest.h>

#ifdef _WIN32
#include <winsock2.h>
#else
#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>
#endif

#include <cstdint>
#include <cstdlib>

namespace lpdeform::client {
namespace {

/// The body of the answer of serve_tests to a GET request. LPDEFORM_TEST_PORT is its port on this machine.
std::string get(const std::string& path) {
#ifdef _WIN32
  static WSADATA data;
  static const int ready = WSAStartup(MAKEWORD(2, 2), &data);
  EXPECT_EQ(ready, 0);
#endif
  const char* const port = std::getenv("LPDEFORM_TEST_PORT");
  EXPECT_NE(port, nullptr) << "start this program by serve_tests";
  const auto connection = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(std::atoi(port != nullptr ? port : "0")));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  EXPECT_EQ(connect(connection, reinterpret_cast<sockaddr*>(&to), sizeof to), 0) << "serve_tests is away";
  const std::string request = "GET " + path + " HTTP/1.0\r\n\r\n";
  send(connection, request.data(), static_cast<int>(request.size()), 0);
  std::string answer;
  char bytes[512];
  for (;;) {
    const auto count = recv(connection, bytes, sizeof bytes, 0);
    if (count <= 0) break;
    answer.append(bytes, static_cast<std::size_t>(count));
  }
#ifdef _WIN32
  closesocket(connection);
#else
  close(connection);
#endif
  EXPECT_NE(answer.find(" 200 "), answer.npos) << path << ": " << answer;
  const std::size_t body = answer.find("\r\n\r\n");
  return body == answer.npos ? "" : answer.substr(body + 4);
}

}  // namespace

RemoteServer::RemoteServer(const std::string& kind) {
  const std::string said = get("/open?kind=" + kind);
  id_ = said.substr(0, said.find(' '));
  address_ = said.substr(said.find(' ') + 1);
}

RemoteServer::~RemoteServer() {
  get("/close?id=" + id_);
}

std::string RemoteServer::ask(const std::string& question) const {
  return get("/" + question + "?id=" + id_);
}

}  // namespace lpdeform::client
