#include "server/access/local_host.h"

#include <arpa/inet.h>

#include <string>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/strip.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestName = 253;

/// The name or address without the port; empty if the port is not a number.
std::string host_of(std::string_view authority) {
  const std::size_t colon = authority.rfind(':'), bracket = authority.rfind(']');
  const bool has_port =
      colon != std::string_view::npos && (bracket == std::string_view::npos || bracket < colon);
  if (!has_port) return std::string(authority);
  for (const char digit : authority.substr(colon + 1)) {
    if (!absl::ascii_isdigit(static_cast<unsigned char>(digit))) return "";
  }
  return std::string(authority.substr(0, colon));
}

}  // namespace

bool names_this_machine(std::string_view authority) {
  std::string host = absl::AsciiStrToLower(host_of(authority));
  if (host.empty() || host.size() > kLongestName) return false;
  if (host == "[::1]") return true;
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  if (host.back() == '.') host.pop_back();
  return host == "localhost" || absl::EndsWith(host, ".localhost");
}

}  // namespace lpdeform
