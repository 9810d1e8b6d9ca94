#include "token_maker.h"

#include <gtest/gtest.h>
#include <jwt.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>

#include <cstdlib>
#include <memory>

namespace lpdeform {
namespace {

using Key = std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)>;

Key generate(TokenMaker::Kind kind) {
  switch (kind) {
    case TokenMaker::Kind::kEcP256:
      return {EVP_EC_gen("P-256"), EVP_PKEY_free};
    case TokenMaker::Kind::kEcP384:
      return {EVP_EC_gen("P-384"), EVP_PKEY_free};
    case TokenMaker::Kind::kRsa2048:
      return {EVP_RSA_gen(2048), EVP_PKEY_free};
    case TokenMaker::Kind::kRsa1024:
      return {EVP_RSA_gen(1024), EVP_PKEY_free};
    case TokenMaker::Kind::kEd25519:
      break;
  }
  return {EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"), EVP_PKEY_free};
}

template <typename Write>
std::string pem_of(Write write) {
  const std::unique_ptr<BIO, decltype(&BIO_free)> sink(BIO_new(BIO_s_mem()), BIO_free);
  EXPECT_EQ(write(sink.get()), 1);
  char* text = nullptr;
  const long size = BIO_get_mem_data(sink.get(), &text);
  return {text, static_cast<std::size_t>(size)};
}

}  // namespace

TokenMaker::TokenMaker(Kind kind) {
  const Key key = generate(kind);
  EXPECT_NE(key, nullptr);
  public_key_ = pem_of([&](BIO* sink) { return PEM_write_bio_PUBKEY(sink, key.get()); });
  private_key_ = pem_of([&](BIO* sink) {
    return PEM_write_bio_PrivateKey(sink, key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  });
}

std::string TokenMaker::sign(const std::string& claims, const std::string& algorithm) const {
  return sign_with(private_key_, claims, algorithm);
}

std::string TokenMaker::sign_with(const std::string& key, const std::string& claims,
                                  const std::string& algorithm) {
  jwt_t* made = nullptr;
  EXPECT_EQ(jwt_new(&made), 0);
  const std::unique_ptr<jwt_t, decltype(&jwt_free)> token(made, jwt_free);
  EXPECT_EQ(jwt_add_grants_json(made, claims.c_str()), 0) << claims;
  if (algorithm != "none") {
    EXPECT_EQ(jwt_set_alg(made, jwt_str_alg(algorithm.c_str()),
                          reinterpret_cast<const unsigned char*>(key.data()), static_cast<int>(key.size())),
              0);
  }
  char* const text = jwt_encode_str(made);
  EXPECT_NE(text, nullptr) << algorithm;
  const std::string result = text == nullptr ? "" : text;
  std::free(text);
  return result;
}

std::string TokenMaker::token_of(const std::string& subject, const std::string& role) const {
  return sign(R"({"sub": ")" + subject + R"(", "lpdeform_role": ")" + role + R"(", "exp": 4102444800})");
}

}  // namespace lpdeform
