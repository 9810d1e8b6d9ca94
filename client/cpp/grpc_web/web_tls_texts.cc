// Checks of certificates without a library for TLS: only the form. libcurl's TLS checks the rest when it connects.

#include "client/cpp/tls_texts.h"

#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

/// The kind of the next block of PEM, of which `text` then has the rest; "" if there is none. `is_whole`: it has an end
/// and base64 in it.
std::string next_block(absl::string_view& text, bool& is_whole) {
  constexpr absl::string_view kBegin = "-----BEGIN ", kDashes = "-----";
  is_whole = false;
  const std::size_t begin = text.find(kBegin);
  if (begin == text.npos) return "";
  text.remove_prefix(begin + kBegin.size());
  const std::string kind(text.substr(0, text.find(kDashes)));
  const std::string end = absl::StrCat("-----END ", kind, "-----");
  const std::size_t stop = text.find(end);
  if (stop == text.npos) return kind;
  std::string bytes;
  const std::size_t start = kind.size() + kDashes.size();
  is_whole = absl::Base64Unescape(text.substr(start, stop - start), &bytes) && !bytes.empty();
  text.remove_prefix(stop + end.size());
  return kind;
}

absl::Status check_certificates(const char* name, absl::string_view text) {
  for (int count = 0;; ++count) {
    bool is_whole = false;
    const std::string kind = next_block(text, is_whole);
    if (kind.empty() && count > 0) return absl::OkStatus();
    if (absl::EndsWith(kind, "CERTIFICATE") && is_whole) continue;
    return make_fault({Reason::kTlsCertificates, name, "PEM"},
                      absl::StrCat(name, " cannot be read: ", count, " certificates in PEM, then ",
                                   kind.empty() ? "none." : "one that is damaged."));
  }
}

absl::Status check_key(absl::string_view text) {
  bool is_whole = false;
  const std::string kind = next_block(text, is_whole);
  if (absl::EndsWith(kind, "PRIVATE KEY") && !absl::StartsWith(kind, "ENCRYPTED") && is_whole)
    return absl::OkStatus();
  return make_fault({Reason::kTlsPrivateKey, "private_key", "PEM, without a password"},
                    "private_key is not a PEM private key, or it has a password.");
}

}  // namespace

absl::Status check_tls(const Tls& tls) {
  if (!tls.root_certificates.empty()) {
    if (absl::Status roots = check_certificates("root_certificates", tls.root_certificates); !roots.ok())
      return roots;
  }
  if (tls.certificate_chain.empty() && tls.private_key.empty()) return absl::OkStatus();
  if (tls.certificate_chain.empty() || tls.private_key.empty()) {
    return make_fault(
        {Reason::kTlsKeyMissing, tls.private_key.empty() ? "private_key" : "certificate_chain", ""},
        "A certificate chain and a private key belong together; one of them is missing.");
  }
#ifdef _WIN32
  return make_fault({Reason::kTlsPrivateKey, "private_key", "none on Windows"},
                    "On Windows, the system's TLS takes no certificate of the client's own as a text.");
#else
  if (absl::Status chain = check_certificates("certificate_chain", tls.certificate_chain); !chain.ok())
    return chain;
  return check_key(tls.private_key);
#endif
}

}  // namespace lpdeform::client
