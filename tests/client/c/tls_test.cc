// TLS of the C interface by gRPC-Web, to the project's Envoy with a certificate that has signed itself.

#include <gmock/gmock.h>

#include <array>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

// In the words of OpenSSL, of Mbed TLS 2 and 3, of libcurl for Schannel, and of this library on Windows.
const auto kSaysUntrusted =
    testing::AnyOf(testing::HasSubstr("SSL certificate problem"), testing::HasSubstr("Cert verify failed"),
                   testing::HasSubstr("is not correctly signed by the trusted CA"),
                   testing::HasSubstr("UNTRUSTED_ROOT"), testing::HasSubstr("certificate is not trusted"));
const auto kSaysOtherHost = testing::AnyOf(
    testing::HasSubstr("no alternative certificate subject name matches"),
    testing::HasSubstr("BADCERT_CN_MISMATCH"), testing::HasSubstr("Common Name (CN) does not match"),
    testing::HasSubstr("failed to match connection hostname"), testing::HasSubstr("it is for another host"));

class CTlsTest : public testing::Test {
 protected:
  CTlsTest() {
    error_.struct_size = sizeof error_;
    options_.struct_size = sizeof options_;
  }
  ~CTlsTest() override {
    lpdeform_close(session_);
    lpdeform_disconnect(client_);
  }

  /// `roots`: null for those of the system.
  void open(const std::string& address, const char* roots) {
    lpdeform_connection connection{};
    connection.struct_size = sizeof connection;
    connection.address = address.c_str();
    connection.tls = 1;
    connection.root_certificates = roots;
    ASSERT_EQ(lpdeform_connect(&connection, &client_, &error_), LPDEFORM_OK) << error_.message;
    const lpdeform_mesh mesh = strip_.mesh();
    ASSERT_EQ(lpdeform_open(client_, &mesh, &options_, &session_, &error_), LPDEFORM_OK) << error_.message;
  }

  /// What the state says about the server that is not reached.
  std::string why_not() {
    EXPECT_TRUE(eventually([&] {
      return lpdeform_session_state(session_, &error_) != LPDEFORM_STATE_CONNECTING ||
             error_.code != LPDEFORM_OK;
    }));
    EXPECT_NE(lpdeform_session_state(session_, &error_), LPDEFORM_STATE_LIVE);
    EXPECT_EQ(error_.code, LPDEFORM_UNAVAILABLE);
    EXPECT_STREQ(error_.reason, "NO_SERVER");
    return error_.message;
  }

  client::InProcessServer server_{client::Transport::kTls};
  const std::string roots_ = server_.root_certificates();
  lpdeform_client* client_ = nullptr;
  lpdeform_session* session_ = nullptr;
  lpdeform_options options_{};
  lpdeform_error error_{};
  Strip strip_;
};

TEST_F(CTlsTest, WorksWithTheRootCertificateThatIsGiven) {
  open(server_.address(), roots_.c_str());
  for (const auto& [name, vertices] : {std::pair{"base", std::array<std::uint32_t, 2>{0, 1}},
                                       std::pair{"tip", std::array<std::uint32_t, 2>{20, 21}}}) {
    lpdeform_handle handle{};
    handle.struct_size = sizeof handle;
    handle.name = name;
    handle.vertices = vertices.data();
    handle.vertex_count = 2;
    handle.motion.kind = LPDEFORM_RIGID;
    handle.motion.translation[1] = vertices[0] == 0 ? 0 : 2;
    ASSERT_EQ(lpdeform_set_handle(session_, &handle, nullptr, &error_), LPDEFORM_OK) << error_.message;
  }
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  lpdeform_frame frame{};
  frame.struct_size = sizeof frame;
  ASSERT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, &frame, &error_), LPDEFORM_OK)
      << error_.message;
  EXPECT_EQ(points[20][1], 2);
}

TEST_F(CTlsTest, ACertificateThatNobodyTrustsIsNamedAsTheCause) {
  open(server_.address(), nullptr);
  EXPECT_THAT(why_not(), kSaysUntrusted);
}

TEST_F(CTlsTest, ACertificateForAnotherHostIsNamedAsTheCause) {
  std::string address = server_.address();
  const std::string name = "localhost";
  address.replace(address.find(name), name.size(), "127.0.0.1");
  open(address, roots_.c_str());
  EXPECT_THAT(why_not(), kSaysOtherHost);
}

}  // namespace
}  // namespace lpdeform::engine
