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

/// Who calls.
struct Caller {
  /// Whose sessions and uploads they are; empty where callers are not told apart.
  std::string subject;
  /// May look at the subject's sessions and change nothing.
  bool is_viewer = false;
  /// Until when the caller is let in, in seconds since 1970; 0: for as long as there is a call.
  std::int64_t until = 0;
};

/// Public keys and the algorithms that each is for.
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

/// Checks bearer tokens: JSON Web Tokens (RFC 7519) signed with one of the keys in a file, which is read again when it
/// changes. A token needs "sub", of 1 to 256 bytes, and "exp"; "nbf" is kept to, "iss" and "aud" where they are
/// expected. "lpdeform_role" may be "viewer" or "editor", and is "editor" where it is left out. Thread-safe.
class Tokens {
 public:
  struct Rules {
    std::string keys_file;
    std::string issuer;    // that "iss" must be; empty: not looked at
    std::string audience;  // that must be in "aud"; empty: not looked at
  };
  /// INVALID_ARGUMENT TOKEN_KEYS.
  static absl::StatusOr<std::unique_ptr<Tokens>> create(Rules rules);

  /// `authorization`: the value of the header, "Bearer <token>". `now`: seconds since 1970. UNAUTHENTICATED
  /// TOKEN_MISSING, TOKEN_INVALID, TOKEN_EXPIRED; no text says more than the token's sender may know.
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
  /// What tells one state of the file from another.
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
  mutable std::map<std::string, Known> known_;  // by the tokens' digests: those that were found good before
};

}  // namespace lpdeform
