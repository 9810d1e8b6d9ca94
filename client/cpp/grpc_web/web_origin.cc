#include "client/cpp/grpc_web/web_origin.h"

#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "client/cpp/address.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

absl::Status invalid(const std::string& address, absl::string_view why) {
  return make_fault({Reason::kAddressInvalid, address,
                     "HOST:PORT, http://HOST:PORT, https://HOST:PORT or unix:PATH, port = 1 to 65535"},
                    absl::StrCat("\"", address, "\" is no address of a gRPC-Web proxy: ", why));
}

/// Whether `text` has only letters that a host and a port may have, so that nothing else of a URL hides in it.
bool is_plain(absl::string_view text) {
  return text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789.-_:[]") ==
         text.npos;
}

}  // namespace

absl::StatusOr<Origin> origin_of(const std::string& address, bool has_tls) {
  absl::string_view host(address);
  if (absl::ConsumePrefix(&host, "unix:")) {
    if (host.empty()) return invalid(address, "after unix: comes the path of a socket.");
    return Origin{has_tls ? "https://localhost" : "http://localhost", std::string(host)};
  }
  const bool is_http = absl::ConsumePrefix(&host, "http://");
  const bool is_https = !is_http && absl::ConsumePrefix(&host, "https://");
  if (is_http && has_tls) return invalid(address, "with certificates, it begins with https://.");
  absl::ConsumeSuffix(&host, "/");
  const bool has_port = host.find(':', host.rfind(']') == host.npos ? 0 : host.rfind(']')) != host.npos;
  const std::string whole =
      (is_http || is_https) && !has_port ? absl::StrCat(host, is_https ? ":443" : ":80") : std::string(host);
  const absl::string_view name = absl::string_view(whole).substr(0, whole.rfind(':'));
  const bool has_scheme = name.find(':') != name.npos && name.front() != '[';
  if (has_scheme || !is_plain(whole))
    return invalid(address, "it has a scheme or a character that it must not have.");
  if (absl::Status checked = check_address(whole); !checked.ok())
    return invalid(address, "there is no such port.");
  return Origin{absl::StrCat(is_https || has_tls ? "https://" : "http://", whole), ""};
}

}  // namespace lpdeform::client
