#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"

namespace lpdeform {

/// An identified caller.
struct Caller {
  /// The owner of the caller's sessions and uploads; empty if callers are not identified.
  std::string subject;
  /// The caller may read the subject's sessions, but not change them.
  bool is_viewer = false;
  /// When the caller's token expires, in seconds since 1970; 0: never during a call.
  std::int64_t until = 0;
};

/// Public keys, and the algorithms that each is for.
class TokenKeys {
 public:
  /// `pem`: one or more "PUBLIC KEY" blocks, RSA of at least 2048 bits (RS256, RS384, RS512) or EC on P-256 (ES256),
  /// P-384 (ES384) or P-521 (ES512). INVALID_ARGUMENT TOKEN_KEYS.
  static absl::StatusOr<TokenKeys> parse(const std::string& pem);

  struct Key {
    std::string pem;
    std::vector<std::string> algorithms;
  };
  const std::vector<Key>& keys() const { return keys_; }

 private:
  std::vector<Key> keys_;
};

/// Checks bearer tokens: JSON Web Tokens (RFC 7519) signed with one of the keys in a file. The file is read
/// again when it changes. A token needs "sub", of 1 to 256 bytes, and "exp". "nbf" is respected; "iss" and
/// "aud" are checked if a value is expected. "lpdeform_role" may be "viewer" or "editor"; the default is
/// "editor". Thread-safe.
class Tokens {
 public:
  struct Rules {
    std::string keys_file;
    std::string issuer;    // required value of "iss"; empty: not checked
    std::string audience;  // required entry of "aud"; empty: not checked
  };
  /// INVALID_ARGUMENT TOKEN_KEYS.
  static absl::StatusOr<std::unique_ptr<Tokens>> create(Rules rules);

  /// `authorization`: the value of the header, "Bearer <token>". `now`: seconds since 1970. UNAUTHENTICATED
  /// TOKEN_MISSING, TOKEN_INVALID, TOKEN_EXPIRED. The texts reveal nothing that the token's sender must not
  /// know.
  absl::StatusOr<Caller> check(std::string_view authorization, std::int64_t now) const;

  /// Reads the file again if it has changed. An error leaves the keys as they are.
  absl::Status refresh();

  static constexpr std::size_t kLongestToken = 8192;
  static constexpr int kLeewaySeconds = 30;

 private:
  struct Known {
    Caller caller;
    std::int64_t expires = 0;
  };
  /// Tells whether the file has changed.
  struct Stamp {
    std::int64_t modified_ns = 0;
    std::int64_t size = -1;
    std::uint64_t inode = 0;
    bool operator==(const Stamp&) const = default;
  };
  explicit Tokens(Rules rules) : rules_(std::move(rules)) {}
  Stamp stamp() const;
  absl::StatusOr<Known> verify(const TokenKeys& keys, const std::string& token, std::int64_t now) const;

  const Rules rules_;
  mutable std::mutex mutex_;
  std::shared_ptr<const TokenKeys> keys_;
  Stamp stamp_;
  mutable std::map<std::string, Known> known_;  // valid tokens seen before, by their digests
};

}  // namespace lpdeform
