#include "client/cpp/tls_texts.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

template <typename T, void (*destroy)(T*)>
struct Deleter {
  void operator()(T* object) const { destroy(object); }
};
using Bio = std::unique_ptr<BIO, Deleter<BIO, BIO_free_all>>;
using Certificate = std::unique_ptr<X509, Deleter<X509, X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Deleter<EVP_PKEY, EVP_PKEY_free>>;

Bio reader_of(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

/// A password callback that fails, instead of prompting on the terminal.
int no_password(char*, int, int, void*) {
  return -1;
}

/// Returns the first certificate of the text; all must be readable.
absl::StatusOr<Certificate> read_certificates(const char* name, const std::string& text) {
  const Bio reader = reader_of(text);
  Certificate first;
  for (int count = 0;; ++count) {
    Certificate one(PEM_read_bio_X509(reader.get(), nullptr, no_password, nullptr));
    if (one == nullptr) {
      const bool is_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
      ERR_clear_error();
      if (is_end && count > 0) return first;
      return make_fault({Reason::kTlsCertificates, name, "PEM"},
                        absl::StrCat(name, " cannot be read: ", count, " certificates in PEM, then ",
                                     is_end ? "none." : "one that is damaged."));
    }
    if (first == nullptr) first = std::move(one);
  }
}

absl::StatusOr<Key> read_key(const std::string& text) {
  Key key(PEM_read_bio_PrivateKey(reader_of(text).get(), nullptr, no_password, nullptr));
  ERR_clear_error();
  if (key != nullptr) return key;
  return make_fault({Reason::kTlsPrivateKey, "private_key", "PEM, without a password"},
                    "private_key is not a PEM private key, or it has a password.");
}

absl::Status check_own(const Tls& tls) {
  if (tls.certificate_chain.empty() || tls.private_key.empty()) {
    return make_fault(
        {Reason::kTlsKeyMissing, tls.private_key.empty() ? "private_key" : "certificate_chain", ""},
        "A certificate chain and a private key belong together; one of them is missing.");
  }
  const auto certificate = read_certificates("certificate_chain", tls.certificate_chain);
  if (!certificate.ok()) return certificate.status();
  const auto key = read_key(tls.private_key);
  if (!key.ok()) return key.status();
  const bool fits = X509_check_private_key(certificate->get(), key->get()) == 1;
  ERR_clear_error();
  if (fits) return absl::OkStatus();
  return make_fault({Reason::kTlsKeyMismatch, "private_key", ""},
                    "private_key is not that of the first certificate of certificate_chain.");
}

}  // namespace

absl::Status check_tls(const Tls& tls) {
  if (!tls.root_certificates.empty()) {
    const auto roots = read_certificates("root_certificates", tls.root_certificates);
    if (!roots.ok()) return roots.status();
  }
  return tls.certificate_chain.empty() && tls.private_key.empty() ? absl::OkStatus() : check_own(tls);
}

}  // namespace lpdeform::client
