#include "server/access/certificates.h"

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <fstream>
#include <sstream>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

using Certificate = std::unique_ptr<X509, decltype(&X509_free)>;
using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;
using Source = std::unique_ptr<BIO, decltype(&BIO_free)>;

absl::Status bad_file(const std::string& file, const std::string& why) {
  return make_fault({Reason::kTlsFiles, file, ""}, absl::StrCat("The TLS file \"", file, "\" ", why, "."));
}

absl::StatusOr<std::string> read(const std::string& name) {
  std::ifstream file(name, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return bad_file(name, "cannot be read");
  return text.str();
}

Source source(const std::string& text) {
  return {BIO_new_mem_buf(text.data(), static_cast<int>(text.size())), BIO_free};
}

/// All certificates in order; empty if there is none, or if one is damaged.
std::vector<Certificate> certificates_in(const std::string& text) {
  const Source from = source(text);
  std::vector<Certificate> all;
  ERR_clear_error();
  while (X509* const one = PEM_read_bio_X509(from.get(), nullptr, nullptr, nullptr))
    all.emplace_back(one, X509_free);
  const bool is_end = ERR_GET_REASON(ERR_peek_last_error()) == PEM_R_NO_START_LINE;
  ERR_clear_error();
  if (!is_end) all.clear();
  return all;
}

int no_password(char*, int, int, void*) {
  return -1;
}

Key key_in(const std::string& text) {
  Key key(PEM_read_bio_PrivateKey(source(text).get(), nullptr, no_password, nullptr), EVP_PKEY_free);
  ERR_clear_error();
  return key;
}

absl::StatusOr<Certificates::Texts> read_all(const TlsFiles& files) {
  if (files.certificate_chain.empty() || files.private_key.empty()) {
    return make_fault({Reason::kTlsFiles, "", ""}, "TLS needs both a certificate chain and its private key.");
  }
  auto chain = read(files.certificate_chain), key = read(files.private_key);
  if (!chain.ok()) return chain.status();
  if (!key.ok()) return key.status();
  absl::StatusOr<std::string> authorities = std::string();
  if (files.knows_clients()) authorities = read(files.client_authorities);
  if (!authorities.ok()) return authorities.status();
  return Certificates::Texts{*std::move(chain), *std::move(key), *std::move(authorities)};
}

/// Checks the files, because with bad ones gRPC would refuse every connection without a useful message.
absl::Status check(const Certificates::Texts& texts, const TlsFiles& files) {
  const std::vector<Certificate> chain = certificates_in(texts.chain);
  if (chain.empty()) return bad_file(files.certificate_chain, "has no certificate that can be read");
  const Key key = key_in(texts.key);
  if (!key || X509_check_private_key(chain.front().get(), key.get()) != 1) {
    ERR_clear_error();
    return bad_file(files.private_key, "has no private key that can be read and fits the certificate");
  }
  if (files.knows_clients() && certificates_in(texts.authorities).empty()) {
    return bad_file(files.client_authorities, "has no certificate that can be read");
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<std::shared_ptr<Certificates>> Certificates::create(TlsFiles files) {
  const std::shared_ptr<Certificates> certificates(new Certificates(std::move(files)));
  if (absl::Status status = certificates->refresh(); !status.ok()) return status;
  return certificates;
}

absl::Status Certificates::refresh() {
  auto texts = read_all(files_);
  if (!texts.ok()) return texts.status();
  const Current before = current();
  if (before.texts != nullptr && *before.texts == *texts) return absl::OkStatus();
  if (absl::Status status = check(*texts, files_); !status.ok()) return status;
  const std::scoped_lock lock(mutex_);
  current_ = {std::make_shared<const Texts>(*std::move(texts)), current_.number + 1};
  return absl::OkStatus();
}

Certificates::Current Certificates::current() const {
  const std::scoped_lock lock(mutex_);
  return current_;
}

}  // namespace lpdeform
