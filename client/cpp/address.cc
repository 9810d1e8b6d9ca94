#include "client/cpp/address.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

constexpr std::array<std::string_view, 7> kSchemes{
    "unix:", "unix-abstract:", "dns:", "ipv4:", "ipv6:", "xds:", "vsock:"};
constexpr std::uint32_t kMostPort = 65535;

bool is_host(std::string_view host) {
  if (host.empty() || host.find('/') != std::string_view::npos) return false;
  const bool is_in_brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
  return is_in_brackets || host.find(':') == std::string_view::npos;
}

bool is_port(std::string_view port) {
  std::uint32_t number = 0;
  return std::ranges::all_of(port, [](char c) { return c >= '0' && c <= '9'; }) &&
         absl::SimpleAtoi(std::string(port), &number) && number >= 1 && number <= kMostPort;
}

}  // namespace

absl::Status check_address(const std::string& address) {
  const auto has_scheme = [&](std::string_view scheme) { return address.starts_with(scheme); };
  if (std::ranges::any_of(kSchemes, has_scheme)) return absl::OkStatus();
  const std::size_t colon = address.rfind(':');
  if (colon != std::string::npos && is_host(std::string_view(address).substr(0, colon)) &&
      is_port(std::string_view(address).substr(colon + 1)))
    return absl::OkStatus();
  return make_fault(
      {Reason::kAddressInvalid, address, "HOST:PORT or unix:PATH, port = 1 to 65535"},
      absl::StrCat("\"", address, "\" is no address of a server: that is HOST:PORT, with a port from 1 to ",
                   kMostPort, ", or unix:PATH."));
}

}  // namespace lpdeform::client
