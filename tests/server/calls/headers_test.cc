// Headers that come twice: it is not known which one was meant.

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "service_fixture.h"
#include "token_maker.h"

namespace lpdeform {
namespace {

using Headers = std::vector<std::pair<std::string, std::string>>;

class HeadersTest : public ServiceTest {
 protected:
  void SetUp() override {}

  /// What a call with these headers is refused for; empty where it is not.
  ErrorDetails refusal(const Headers& headers) {
    grpc::ClientContext context;
    introduce(context, headers);
    v1::ListSessionsResponse response;
    const grpc::Status status = stub_->ListSessions(&context, {}, &response);
    return status.ok() ? ErrorDetails{} : details_of(status);
  }
  ErrorDetails refusal_of_a_stream(const Headers& headers) {
    grpc::ClientContext context;
    introduce(context, headers);
    const auto stream = stub_->Deform(&context);
    v1::DeformResponse response;
    EXPECT_FALSE(stream->Read(&response));
    return details_of(stream->Finish());
  }

 private:
  static void introduce(grpc::ClientContext& context, const Headers& headers) {
    context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
    for (const auto& [name, value] : headers) context.AddMetadata(name, value);
  }
};

class HeadersWithTokensTest : public HeadersTest {
 protected:
  HeadersWithTokensTest()
      : file_(std::filesystem::temp_directory_path() / ("lpdeform-headers-" + std::to_string(getpid()))) {
    std::ofstream(file_) << maker_.public_key();
    options_.token_keys_file = file_;
  }
  ~HeadersWithTokensTest() override { std::filesystem::remove(file_); }

  const TokenMaker maker_;
  const std::filesystem::path file_;
};

TEST_F(HeadersWithTokensTest, TwoAuthorizationsAreRefusedWhateverTheyAre) {
  start();
  const std::string good = "Bearer " + maker_.token_of("alice"), other = "Bearer " + maker_.token_of("bob");
  EXPECT_EQ(refusal({{"authorization", good}}).info.reason(), "");
  for (const Headers& both : {Headers{{"authorization", good}, {"authorization", other}},
                              Headers{{"authorization", other}, {"authorization", good}},
                              Headers{{"authorization", good}, {"authorization", good}},
                              Headers{{"authorization", "Bearer x"}, {"authorization", good}},
                              Headers{{"authorization", good}, {"authorization", ""}}}) {
    const ErrorDetails details = refusal(both);
    EXPECT_EQ(details.info.reason(), "AUTHORIZATION_TWICE");
    EXPECT_EQ(details.info.metadata().at("element"), "authorization");
    EXPECT_EQ(refusal_of_a_stream(both).info.reason(), "AUTHORIZATION_TWICE");
  }
}

TEST_F(HeadersTest, TwoRoutesAreRefused) {
  start();
  EXPECT_EQ(refusal({{"lpdeform-session", "a"}}).info.reason(), "");
  const ErrorDetails details = refusal({{"lpdeform-session", "a"}, {"lpdeform-session", "b"}});
  EXPECT_EQ(details.info.reason(), "ROUTE_TWICE");
  EXPECT_EQ(details.info.metadata().at("element"), "lpdeform-session");
  EXPECT_TRUE(details.bad_request.has_value());
  EXPECT_EQ(refusal_of_a_stream({{"lpdeform-session", "a"}, {"lpdeform-session", "a"}}).info.reason(),
            "ROUTE_TWICE");
}

TEST_F(HeadersTest, WhatTheServerDoesNotReadMayComeTwice) {
  start();
  const std::string parent = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01";
  EXPECT_EQ(refusal({{"traceparent", parent}, {"traceparent", parent}, {"x", "1"}, {"x", "2"}}).info.reason(),
            "");
  EXPECT_EQ(refusal({{"authorization", "a"}, {"authorization", "b"}}).info.reason(), "");  // no tokens here
}

}  // namespace
}  // namespace lpdeform
