#pragma once

#include <functional>
#include <string>

namespace lpdeform {

/// A pair of keys, just made, and tokens signed with it.
class TokenMaker {
 public:
  enum class Kind { kEcP256, kEcP384, kRsa2048, kRsa1024, kEd25519 };
  explicit TokenMaker(Kind kind = Kind::kEcP256);

  /// PEM.
  const std::string& public_key() const { return public_key_; }

  /// `claims`: a JSON object. `algorithm` as in the header of the token: "ES256".
  std::string sign(const std::string& claims, const std::string& algorithm = "ES256") const;
  /// The same with any text for a key, such as a public one.
  static std::string sign_with(const std::string& key, const std::string& claims,
                               const std::string& algorithm);

  /// Good until the year 2100.
  std::string token_of(const std::string& subject, const std::string& role = "editor") const;

 private:
  std::string public_key_, private_key_;
};

}  // namespace lpdeform
