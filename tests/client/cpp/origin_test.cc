#include "client/cpp/grpc_web/web_origin.h"

#include <gtest/gtest.h>

#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

TEST(Origin, FollowsFromTheAddressAndTheCertificates) {
  EXPECT_EQ(origin_of("localhost:8080", false)->url, "http://localhost:8080");
  EXPECT_EQ(origin_of("localhost:8080", true)->url, "https://localhost:8080");
  EXPECT_EQ(origin_of("http://10.0.0.1:8080/", false)->url, "http://10.0.0.1:8080");
  EXPECT_EQ(origin_of("https://example.org", false)->url, "https://example.org:443");
  EXPECT_EQ(origin_of("http://example.org", false)->url, "http://example.org:80");
  EXPECT_EQ(origin_of("https://[::1]", true)->url, "https://[::1]:443");
  EXPECT_EQ(origin_of("[::1]:8080", false)->url, "http://[::1]:8080");
  EXPECT_EQ(origin_of("unix:/tmp/socket", false)->socket, "/tmp/socket");
}

TEST(Origin, RefusesWhatIsNoAddress) {
  for (const char* address :
       {"", "localhost", "localhost:0", "localhost:65536", "ftp://localhost:80", "dns:localhost:80",
        "unix:", "http://user:word@localhost:80", "http://localhost:80/path", "http://", "local host:80",
        "localhost:80\r\nX: y", "http://localhost:80?x", "::1"}) {
    const absl::Status refused = origin_of(address, false).status();
    EXPECT_TRUE(fault_of(refused).reason == Reason::kAddressInvalid) << address << ": " << refused;
  }
  EXPECT_FALSE(origin_of("http://localhost:80", true).ok());
}

}  // namespace
}  // namespace lpdeform::client
