#include "server/access/tokens.h"

#include <jwt.h>
#include <openssl/bio.h>
#include <openssl/ec.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/sha.h>
#include <sys/stat.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

constexpr int kLeastRsaBits = 2048;
constexpr std::size_t kLongestSubject = 256;
constexpr double kFarthestDate = 1e15;  // in seconds; a double is exact up to this
/// How many valid tokens are cached. When there are more, the cache is cleared, and tokens are verified
/// again.
constexpr std::size_t kMostKnown = 4096;

using Jwt = std::unique_ptr<jwt_t, decltype(&jwt_free)>;

absl::Status bad_keys(const std::string& why) {
  return make_fault({Reason::kTokenKeys, "token keys", ""},
                    absl::StrCat("The file of token keys ", why, "."));
}

absl::Status bad_token(Reason reason, const std::string& text) {
  return make_fault({reason, "authorization", ""}, text);
}

absl::Status invalid_token() {
  return bad_token(Reason::kTokenInvalid, "The bearer token is not one that this server takes.");
}

/// Empty if the key's kind or size is not accepted.
std::vector<std::string> algorithms_of(const EVP_PKEY& key) {
  const int bits = EVP_PKEY_bits(&key);
  if (EVP_PKEY_base_id(&key) == EVP_PKEY_RSA && bits >= kLeastRsaBits) return {"RS256", "RS384", "RS512"};
  if (EVP_PKEY_base_id(&key) != EVP_PKEY_EC) return {};
  char curve[64] = {};
  if (EVP_PKEY_get_group_name(&key, curve, sizeof(curve), nullptr) != 1) return {};
  const std::string_view name = curve;
  if (name == "prime256v1" || name == "P-256") return {"ES256"};
  if (name == "secp384r1" || name == "P-384") return {"ES384"};
  if (name == "secp521r1" || name == "P-521") return {"ES512"};
  return {};
}

/// All claims; not an object if they cannot be read.
nlohmann::json claims_of(jwt_t* token) {
  char* const text = jwt_get_grants_json(token, nullptr);
  const auto claims = nlohmann::json::parse(text == nullptr ? "" : text, nullptr, false);
  std::free(text);
  return claims;
}

/// A claim that is a text; empty if it is absent or of another type.
std::string text_of(const nlohmann::json& claims, const char* claim) {
  const auto found = claims.find(claim);
  return found != claims.end() && found->is_string() ? found->get<std::string>() : "";
}

/// A claim that is a date; NaN if it is of another type.
double date_of(const nlohmann::json& claims, const char* claim, double left_out) {
  const auto found = claims.find(claim);
  if (found == claims.end()) return left_out;
  return found->is_number() ? found->get<double>() : std::nan("");
}

/// "aud" is a text or a list of texts.
bool is_for(const nlohmann::json& claims, const std::string& audience) {
  const auto found = claims.find("aud");
  if (found == claims.end()) return false;
  if (found->is_array()) return std::find(found->begin(), found->end(), audience) != found->end();
  return found->is_string() && *found == audience;
}

/// Whether the token has only dots and characters of base64url; the library would skip others.
bool is_word(std::string_view token) {
  return std::all_of(token.begin(), token.end(), [](char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '-' || c == '_' || c == '.';
  });
}

/// The token, if this key signed it. The library takes the algorithm from the token, so it would accept a
/// token "signed" with the public key as a shared secret. Therefore the algorithm must be one that the key is
/// for.
Jwt open_with(const TokenKeys::Key& key, const std::string& token) {
  jwt_t* opened = nullptr;
  const int error = jwt_decode(&opened, token.c_str(), reinterpret_cast<const unsigned char*>(key.pem.data()),
                               static_cast<int>(key.pem.size()));
  Jwt result(error == 0 ? opened : nullptr, jwt_free);
  if (!result) return result;
  const char* const algorithm = jwt_alg_str(jwt_get_alg(result.get()));
  const bool is_meant = algorithm != nullptr && std::find(key.algorithms.begin(), key.algorithms.end(),
                                                          algorithm) != key.algorithms.end();
  if (!is_meant) result.reset();
  return result;
}

std::string digest_of(std::string_view token) {
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

}  // namespace

absl::StatusOr<TokenKeys> TokenKeys::parse(const std::string& pem) {
  constexpr std::string_view kBegin = "-----BEGIN PUBLIC KEY-----", kEnd = "-----END PUBLIC KEY-----";
  TokenKeys result;
  for (std::size_t begin = pem.find(kBegin); begin != std::string::npos; begin = pem.find(kBegin, begin)) {
    const std::size_t end = pem.find(kEnd, begin);
    if (end == std::string::npos) return bad_keys("has a key without an end");
    Key key{pem.substr(begin, end + kEnd.size() - begin) + "\n", {}};
    const std::unique_ptr<BIO, decltype(&BIO_free)> source(
        BIO_new_mem_buf(key.pem.data(), static_cast<int>(key.pem.size())), BIO_free);
    const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> parsed(
        PEM_read_bio_PUBKEY(source.get(), nullptr, nullptr, nullptr), EVP_PKEY_free);
    const std::string number = absl::StrCat("key ", result.keys_.size() + 1);
    if (parsed == nullptr) return bad_keys(absl::StrCat("has a ", number, " that cannot be read"));
    key.algorithms = algorithms_of(*parsed);
    if (key.algorithms.empty()) {
      return bad_keys(absl::StrCat("has a ", number, " that is neither RSA of at least ", kLeastRsaBits,
                                   " bits nor EC on P-256, P-384 or P-521"));
    }
    result.keys_.push_back(std::move(key));
    begin = end;
  }
  if (result.keys_.empty()) return bad_keys("has no PEM block \"PUBLIC KEY\"");
  return result;
}

absl::StatusOr<std::unique_ptr<Tokens>> Tokens::create(Rules rules) {
  std::unique_ptr<Tokens> tokens(new Tokens(std::move(rules)));
  if (absl::Status status = tokens->refresh(); !status.ok()) return status;
  return tokens;
}

Tokens::Stamp Tokens::stamp() const {
  struct stat about {};
  if (stat(rules_.keys_file.c_str(), &about) != 0) return {};
  return {about.st_mtim.tv_sec * 1'000'000'000 + about.st_mtim.tv_nsec, about.st_size, about.st_ino};
}

absl::Status Tokens::refresh() {
  const Stamp now = stamp();
  {
    const std::scoped_lock lock(mutex_);
    if (keys_ != nullptr && now == stamp_) return absl::OkStatus();
  }
  std::ifstream file(rules_.keys_file, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  if (!file) return bad_keys(absl::StrCat("\"", rules_.keys_file, "\" cannot be read"));
  auto keys = TokenKeys::parse(text.str());
  if (!keys.ok()) return keys.status();
  const std::scoped_lock lock(mutex_);
  keys_ = std::make_shared<const TokenKeys>(*std::move(keys));
  stamp_ = now;
  known_.clear();  // tokens of a removed key are not valid any more
  return absl::OkStatus();
}

absl::StatusOr<Caller> Tokens::check(std::string_view authorization, std::int64_t now) const {
  constexpr std::string_view kScheme = "Bearer ";
  if (authorization.empty()) {
    return bad_token(Reason::kTokenMissing, "A call needs the header \"authorization: Bearer <token>\".");
  }
  const bool is_bearer = absl::StartsWithIgnoreCase({authorization.data(), authorization.size()}, "Bearer ");
  if (!is_bearer || authorization.size() > kScheme.size() + kLongestToken) return invalid_token();
  const std::string token(authorization.substr(kScheme.size()));
  if (!is_word(token)) return invalid_token();
  const std::string digest = digest_of(token);
  std::shared_ptr<const TokenKeys> keys;
  {
    const std::scoped_lock lock(mutex_);
    const auto known = known_.find(digest);
    if (known != known_.end() && now <= known->second.expires + kLeewaySeconds) return known->second.caller;
    keys = keys_;
  }
  auto verified = verify(*keys, token, now);
  if (!verified.ok()) return verified.status();
  const std::scoped_lock lock(mutex_);
  if (known_.size() >= kMostKnown) known_.clear();
  if (keys == keys_) known_[digest] = *verified;  // unless the keys have changed meanwhile
  return verified->caller;
}

absl::StatusOr<Tokens::Known> Tokens::verify(const TokenKeys& keys, const std::string& token,
                                             std::int64_t now) const {
  Jwt opened(nullptr, jwt_free);
  for (const TokenKeys::Key& key : keys.keys()) {
    opened = open_with(key, token);
    if (opened) break;
  }
  if (!opened) return invalid_token();
  const nlohmann::json claims = claims_of(opened.get());
  if (!claims.is_object()) return invalid_token();
  const double nan = std::nan("");
  const double expires = date_of(claims, "exp", nan), begins = date_of(claims, "nbf", 0);
  if (!(std::abs(expires) < kFarthestDate) || !(std::abs(begins) < kFarthestDate)) return invalid_token();
  if (static_cast<double>(now) > expires + kLeewaySeconds)
    return bad_token(Reason::kTokenExpired, "The bearer token has expired.");
  if (static_cast<double>(now) < begins - kLeewaySeconds) return invalid_token();

  const std::string subject = text_of(claims, "sub");
  const std::string role = claims.contains("lpdeform_role") ? text_of(claims, "lpdeform_role") : "editor";
  if (subject.empty() || subject.size() > kLongestSubject) return invalid_token();
  if (role != "editor" && role != "viewer") return invalid_token();
  if (!rules_.issuer.empty() && text_of(claims, "iss") != rules_.issuer) return invalid_token();
  if (!rules_.audience.empty() && !is_for(claims, rules_.audience)) return invalid_token();
  const auto last = static_cast<std::int64_t>(std::floor(expires));
  return Known{{subject, role == "viewer", last + kLeewaySeconds}, last};
}

}  // namespace lpdeform
