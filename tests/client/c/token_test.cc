// Bearer tokens through the C interface, on a server that asks for them.

#include <gtest/gtest.h>

#include <string>

#include "client/c/lpdeform.h"
#include "tests/client/c/session_fixture.h"

namespace lpdeform {
namespace {

class CTokenTest : public testing::Test {
 protected:
  CTokenTest() {
    error_.struct_size = sizeof error_;
    lpdeform_connection connection{};
    connection.struct_size = sizeof connection;
    connection.address = address_.c_str();
    EXPECT_EQ(lpdeform_connect(&connection, &client_, &error_), LPDEFORM_OK) << error_.message;
  }
  ~CTokenTest() override { lpdeform_disconnect(client_); }

  /// How a session of a triangle gets on: its state once it is no longer connecting, with the reason in error_.
  lpdeform_state open() {
    const engine::Triangle triangle;
    const lpdeform_mesh mesh = triangle.mesh();
    lpdeform_session* session = nullptr;
    EXPECT_EQ(lpdeform_open(client_, &mesh, nullptr, &session, &error_), LPDEFORM_OK) << error_.message;
    lpdeform_state state = LPDEFORM_STATE_CONNECTING;
    engine::eventually([&] {
      state = lpdeform_session_state(session, &error_);
      return state != LPDEFORM_STATE_CONNECTING;
    });
    lpdeform_close(session);
    return state;
  }

  const client::TokenServer server_;
  const std::string address_ = server_.address();
  lpdeform_client* client_ = nullptr;
  lpdeform_error error_{};
};

TEST_F(CTokenTest, ATokenThatNoHeaderCanCarryIsRefusedAndNotRepeated) {
  for (const std::string token : {"secret\n", "sec\rret", "secr\xc3\xa9t", "secret\x7f"}) {
    EXPECT_EQ(lpdeform_set_token(client_, token.c_str(), &error_), LPDEFORM_INVALID_ARGUMENT);
    EXPECT_STREQ(error_.reason, "TOKEN_CHARACTERS");
    EXPECT_EQ(std::string(error_.message).find("sec"), std::string::npos) << error_.message;
    lpdeform_connection connection{};
    connection.struct_size = sizeof connection;
    connection.address = address_.c_str();
    connection.token = token.c_str();
    lpdeform_client* none = nullptr;
    EXPECT_EQ(lpdeform_connect(&connection, &none, &error_), LPDEFORM_INVALID_ARGUMENT);
    EXPECT_EQ(none, nullptr);
  }
}

TEST_F(CTokenTest, WithoutATokenTheSessionIsRefused) {
  EXPECT_EQ(open(), LPDEFORM_STATE_REFUSED);
  EXPECT_EQ(error_.code, LPDEFORM_UNAUTHENTICATED);
  EXPECT_STREQ(error_.reason, "TOKEN_MISSING");
}

TEST_F(CTokenTest, ATokenLetsInFromTheNextCallOn) {
  ASSERT_EQ(lpdeform_set_token(client_, "nonsense", &error_), LPDEFORM_OK);
  EXPECT_EQ(open(), LPDEFORM_STATE_REFUSED);
  EXPECT_STREQ(error_.reason, "TOKEN_INVALID");
  ASSERT_EQ(lpdeform_set_token(client_, server_.token().c_str(), &error_), LPDEFORM_OK);
  EXPECT_EQ(open(), LPDEFORM_STATE_LIVE) << error_.message;
}

}  // namespace
}  // namespace lpdeform
