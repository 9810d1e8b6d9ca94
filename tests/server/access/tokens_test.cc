#include "server/access/tokens.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "core/base/fault.h"
#include "token_maker.h"

namespace lpdeform {
namespace {

constexpr std::int64_t kNow = 1'800'000'000;

class TokensTest : public testing::Test {
 protected:
  TokensTest()
      : file_(std::filesystem::temp_directory_path() / ("lpdeform-keys-" + std::to_string(getpid()))) {}
  ~TokensTest() override { std::filesystem::remove(file_); }

  /// In one step, as whoever rotates keys ought to.
  void write(const std::string& pem) {
    const std::string next = file_.string() + ".next";
    std::ofstream(next) << pem;
    std::filesystem::rename(next, file_);
  }
  void start(const std::string& issuer = "", const std::string& audience = "") {
    if (!std::filesystem::exists(file_)) write(maker_.public_key());
    auto made = Tokens::create({file_, issuer, audience});
    ASSERT_TRUE(made.ok()) << made.status();
    tokens_ = *std::move(made);
  }
  /// "subject", "viewer subject", or the reason of the refusal.
  std::string check(const std::string& token, std::int64_t now = kNow) const {
    const auto caller = tokens_->check("Bearer " + token, now);
    if (!caller.ok()) return fault_of(caller.status()).reason;
    return (caller->is_viewer ? "viewer " : "") + caller->subject;
  }
  std::string check_claims(const std::string& claims, std::int64_t now = kNow) const {
    return check(maker_.sign(claims), now);
  }

  const std::filesystem::path file_;
  const TokenMaker maker_;
  std::unique_ptr<Tokens> tokens_;
};

TEST_F(TokensTest, TakesATokenOfItsKeysAndKnowsItsRole) {
  start();
  EXPECT_EQ(check_claims(R"({"sub": "alice", "exp": 1800000100})"), "alice");
  EXPECT_EQ(check_claims(R"({"sub": "alice", "exp": 1800000100, "lpdeform_role": "editor"})"), "alice");
  EXPECT_EQ(check_claims(R"({"sub": "alice", "exp": 1800000100, "lpdeform_role": "viewer"})"),
            "viewer alice");
  EXPECT_EQ(tokens_->check("bearer " + maker_.token_of("bob"), kNow)->subject, "bob");
}

TEST_F(TokensTest, EveryAlgorithmOfAKeyIsTaken) {
  const TokenMaker rsa(TokenMaker::Kind::kRsa2048), p384(TokenMaker::Kind::kEcP384);
  write("One key:\n" + rsa.public_key() + "another:\n" + p384.public_key());
  start();
  const std::string claims = R"({"sub": "alice", "exp": 1800000100})";
  for (const char* const algorithm : {"RS256", "RS384", "RS512"})
    EXPECT_EQ(check(rsa.sign(claims, algorithm)), "alice");
  EXPECT_EQ(check(p384.sign(claims, "ES384")), "alice");
  EXPECT_EQ(check(maker_.sign(claims)), "TOKEN_INVALID");
}

TEST_F(TokensTest, RefusesForgeries) {
  start();
  const std::string claims = R"({"sub": "alice", "exp": 1800000100})";
  const std::string good = maker_.sign(claims);
  EXPECT_EQ(check(TokenMaker().sign(claims)), "TOKEN_INVALID") << "another's key";
  EXPECT_EQ(check(TokenMaker::sign_with("", claims, "none")), "TOKEN_INVALID");
  // The public key is no secret, and must not pass for one.
  EXPECT_EQ(check(TokenMaker::sign_with(maker_.public_key(), claims, "HS256")), "TOKEN_INVALID");
  const std::size_t payload = good.find('.') + 1, signature = good.rfind('.') + 1;
  for (const std::size_t at : {payload + 3, signature + 3}) {
    std::string changed = good;
    changed[at] = changed[at] == 'A' ? 'B' : 'A';
    EXPECT_EQ(check(changed), "TOKEN_INVALID") << at;
  }
  EXPECT_EQ(check(good.substr(0, signature)), "TOKEN_INVALID");
  EXPECT_EQ(check(good), "alice");
}

TEST_F(TokensTest, RefusesWhatIsNoToken) {
  start();
  for (const std::string& wrong : {std::string(""), std::string("."), std::string(".."), std::string("a.b.c"),
                                   std::string("bm90.anNvbg.eA"), std::string(Tokens::kLongestToken + 1, 'a'),
                                   std::string("a\0b", 3), maker_.token_of("alice") + " "}) {
    EXPECT_EQ(check(wrong), "TOKEN_INVALID") << wrong.substr(0, 20);
  }
  EXPECT_EQ(fault_of(tokens_->check("", kNow).status()).reason, "TOKEN_MISSING");
  EXPECT_EQ(fault_of(tokens_->check("Basic YTpi", kNow).status()).reason, "TOKEN_INVALID");
  EXPECT_TRUE(absl::IsUnauthenticated(tokens_->check("", kNow).status()));
}

TEST_F(TokensTest, KeepsToTheDatesOfAToken) {
  start();
  const std::string token = maker_.sign(R"({"sub": "alice", "exp": 1800000100, "nbf": 1799999000})");
  EXPECT_EQ(check(token), "alice");
  EXPECT_EQ(check(token, 1'800'000'100 + Tokens::kLeewaySeconds), "alice");
  EXPECT_EQ(check(token, 1'800'000'101 + Tokens::kLeewaySeconds), "TOKEN_EXPIRED")
      << "although it was good before";
  EXPECT_EQ(check_claims(R"({"sub": "alice", "exp": 1800000100, "nbf": 1800000031})"), "TOKEN_INVALID");
  EXPECT_EQ(check_claims(R"({"sub": "alice", "exp": 1800000100, "nbf": 1800000030})"), "alice");
  for (const char* const wrong :
       {R"({"sub": "alice"})", R"({"sub": "alice", "exp": "1800000100"})", R"({"sub": "alice", "exp": null})",
        R"({"sub": "alice", "exp": true})", R"({"sub": "alice", "exp": 1e300})",
        R"({"sub": "alice", "exp": [1800000100]})",
        R"({"sub": "alice", "exp": 1800000100, "nbf": "never"})"}) {
    EXPECT_EQ(check_claims(wrong), "TOKEN_INVALID") << wrong;
  }
}

TEST_F(TokensTest, RefusesSubjectsAndRolesThatItDoesNotKnow) {
  start();
  for (const std::string& wrong :
       {std::string(R"({"exp": 1800000100})"), std::string(R"({"sub": "", "exp": 1800000100})"),
        std::string(R"({"sub": 7, "exp": 1800000100})"),
        R"({"exp": 1800000100, "sub": ")" + std::string(257, 'a') + R"("})",
        std::string(R"({"sub": "alice", "exp": 1800000100, "lpdeform_role": "admin"})"),
        std::string(R"({"sub": "alice", "exp": 1800000100, "lpdeform_role": ["viewer"]})"),
        std::string(R"({"sub": "alice", "exp": 1800000100, "lpdeform_role": 1})")}) {
    EXPECT_EQ(check_claims(wrong), "TOKEN_INVALID") << wrong.substr(0, 80);
  }
}

TEST_F(TokensTest, KeepsToIssuerAndAudienceWhereTheyAreExpected) {
  start("https://studio", "lpdeform");
  const auto claims = [](const std::string& rest) {
    return R"({"sub": "alice", "exp": 1800000100)" + rest + "}";
  };
  EXPECT_EQ(check_claims(claims(R"(, "iss": "https://studio", "aud": "lpdeform")")), "alice");
  EXPECT_EQ(check_claims(claims(R"(, "iss": "https://studio", "aud": ["farm", "lpdeform"])")), "alice");
  for (const char* const wrong :
       {"", R"(, "iss": "https://studio")", R"(, "aud": "lpdeform")",
        R"(, "iss": "https://studio/", "aud": "lpdeform")", R"(, "iss": "https://studio", "aud": ["farm"])",
        R"(, "iss": "https://studio", "aud": {"lpdeform": 1})"}) {
    EXPECT_EQ(check_claims(claims(wrong)), "TOKEN_INVALID") << wrong;
  }
}

TEST_F(TokensTest, KeysAreRotatedWhileItRuns) {
  start();
  const TokenMaker next;
  const std::string old_token = maker_.token_of("alice"), new_token = next.token_of("alice");
  EXPECT_EQ(check(old_token), "alice");
  EXPECT_EQ(check(new_token), "TOKEN_INVALID");
  write(maker_.public_key() + next.public_key());
  ASSERT_TRUE(tokens_->refresh().ok());
  EXPECT_EQ(check(old_token), "alice");
  EXPECT_EQ(check(new_token), "alice");
  write(next.public_key());
  ASSERT_TRUE(tokens_->refresh().ok());
  EXPECT_EQ(check(old_token), "TOKEN_INVALID") << "although it was good before";
  EXPECT_EQ(check(new_token), "alice");
  write("half a file, -----BEGIN PUBLIC KEY-----");
  EXPECT_EQ(fault_of(tokens_->refresh()).reason, "TOKEN_KEYS");
  EXPECT_EQ(check(new_token), "alice") << "the keys stay as they were";
}

TEST_F(TokensTest, SaysWhatIsWrongWithAFileOfKeys) {
  const auto text_of = [&](const std::string& pem) {
    write(pem);
    const auto made = Tokens::create({file_, "", ""});
    EXPECT_EQ(fault_of(made.status()).reason, "TOKEN_KEYS");
    return std::string(made.status().message());
  };
  EXPECT_NE(text_of("").find("has no PEM block"), std::string::npos);
  EXPECT_NE(text_of("-----BEGIN PUBLIC KEY-----\nAAAA\n-----END PUBLIC KEY-----\n")
                .find("key 1 that cannot be read"),
            std::string::npos);
  EXPECT_NE(text_of(maker_.public_key() + TokenMaker(TokenMaker::Kind::kRsa1024).public_key())
                .find("key 2 that is neither"),
            std::string::npos);
  EXPECT_NE(text_of(TokenMaker(TokenMaker::Kind::kEd25519).public_key()).find("neither"), std::string::npos);
  EXPECT_NE(Tokens::create({"/no/such/file", "", ""}).status().message().find("cannot be read"),
            std::string::npos);
}

}  // namespace
}  // namespace lpdeform
