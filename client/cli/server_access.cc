#include "client/cli/server_access.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/files/text_file.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::cli {
namespace {

/// A year: practically no limit, but still a time that every clock can count.
constexpr std::chrono::hours kPatience{24 * 365};

absl::Status read_into(const std::string& file, std::string& out) {
  if (file.empty()) return absl::OkStatus();
  auto text = read_text(file);
  if (!text.ok()) return text.status();
  out = *std::move(text);
  return absl::OkStatus();
}

absl::StatusOr<std::string> read_token(const std::string& file) {
  auto text = read_text(file);
  if (!text.ok()) return text.status();
  const std::string token(absl::StripAsciiWhitespace(*text));
  const bool is_word =
      !token.empty() && std::all_of(token.begin(), token.end(), [](char c) { return c > ' ' && c < 127; });
  if (is_word) return token;
  return make_fault({Reason::kTokenFile, file, "one word"},
                    absl::StrCat("\"", file, "\" does not hold a token."));
}

}  // namespace

absl::StatusOr<client::ClientOptions> client_options(const ServerAccess& access) {
  client::ClientOptions options;
  if (!access.address) {
    options.call_timeout = kPatience;  // this process does the work itself, so the call may take any time
    return options;
  }
  if (access.tls || !access.tls_ca.empty() || !access.tls_cert.empty() || !access.tls_key.empty()) {
    client::Tls& tls = options.tls.emplace();
    for (const auto& [file, out] : {std::pair(&access.tls_ca, &tls.root_certificates),
                                    std::pair(&access.tls_cert, &tls.certificate_chain),
                                    std::pair(&access.tls_key, &tls.private_key)}) {
      if (absl::Status status = read_into(*file, *out); !status.ok()) return status;
    }
  }
  if (!access.token_file.empty()) {
    if (auto token = read_token(access.token_file); !token.ok()) return token.status();
    // A file that is just being replaced gives no token. The server then refuses the call, which is retried
    // or fails.
    options.token = [file = access.token_file] { return read_token(file).value_or(""); };
  }
  return options;
}

}  // namespace lpdeform::cli
