// Certificates and keys that cannot be used are reported before any connection is tried.

#include "client/cpp/tls_texts.h"

#include <gtest/gtest.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/x509.h>

#include <string>

#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

std::string text_of(BIO* bio) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(bio, &data);
  std::string text(data, static_cast<std::size_t>(size));
  BIO_free(bio);
  return text;
}

/// A key, just made, and a certificate that it has signed for itself.
struct Identity {
  Identity() {
    EVP_PKEY* const pair = EVP_EC_gen("P-256");
    X509* const own = X509_new();
    X509_gmtime_adj(X509_getm_notBefore(own), 0);
    X509_gmtime_adj(X509_getm_notAfter(own), 3600);
    X509_set_pubkey(own, pair);
    EXPECT_GT(X509_sign(own, pair, EVP_sha256()), 0);
    BIO* bio = BIO_new(BIO_s_mem());
    PEM_write_bio_X509(bio, own);
    certificate = text_of(bio);
    bio = BIO_new(BIO_s_mem());
    PEM_write_bio_PKCS8PrivateKey(bio, pair, nullptr, nullptr, 0, nullptr, nullptr);
    key = text_of(bio);
    bio = BIO_new(BIO_s_mem());
    PEM_write_bio_PKCS8PrivateKey(bio, pair, EVP_aes_256_cbc(), "secret", 6, nullptr, nullptr);
    locked_key = text_of(bio);
    X509_free(own);
    EVP_PKEY_free(pair);
  }

  std::string certificate, key, locked_key;
};

Fault fault_in(const Tls& tls) {
  return fault_of(check_tls(tls));
}

TEST(TlsTexts, ThoseThatBelongTogetherAreTaken) {
  const Identity one, two;
  EXPECT_TRUE(check_tls({}).ok());
  EXPECT_TRUE(
      check_tls({one.certificate + two.certificate, one.certificate + two.certificate, one.key}).ok());
}

TEST(TlsTexts, WhatIsNoCertificateIsNamed) {
  const Identity one;
  std::string damaged = one.certificate;
  damaged[damaged.size() / 2] = '!';
  for (const std::string& text : {std::string("garbage"), one.key, damaged, one.certificate + damaged}) {
    EXPECT_EQ(fault_in({text}).reason, "TLS_CERTIFICATES") << text;
    EXPECT_EQ(fault_in({text}).element, "root_certificates");
    EXPECT_EQ(fault_in({"", text, one.key}).element, "certificate_chain");
  }
}

TEST(TlsTexts, AKeyIsReadableAndThatOfItsCertificate) {
  const Identity one, two;
  EXPECT_EQ(fault_in({"", one.certificate, "garbage"}).reason, "TLS_PRIVATE_KEY");
  EXPECT_EQ(fault_in({"", one.certificate, one.locked_key}).reason,
            "TLS_PRIVATE_KEY");  // asks nobody for a password
  EXPECT_EQ(fault_in({"", one.certificate, two.key}).reason, "TLS_KEY_MISMATCH");
  EXPECT_EQ(fault_in({"", one.certificate, ""}).element, "private_key");
  EXPECT_EQ(fault_in({"", "", one.key}).element, "certificate_chain");
}

}  // namespace
}  // namespace lpdeform::client
