#include "client/cpp/address.h"

#include <gtest/gtest.h>

#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

TEST(Address, IsHostAndPortOrASocket) {
  for (const char* address : {"127.0.0.1:1", "localhost:65535", "[::1]:50051", "deform.example.com:443",
                              "unix:/run/a.sock", "unix-abstract:a", "dns:///a.example:70000"})
    EXPECT_TRUE(check_address(address).ok()) << address;
}

TEST(Address, IsRefusedByNameWhereItIsNone) {
  // 105333 is 39797 and 65536 more: gRPC would go to port 39797.
  for (const char* address : {"127.0.0.1:105333", "127.0.0.1:65536", "127.0.0.1:0", "", "39797", ":50051",
                              "localhost", "localhost:", "http://localhost:50051", "localhost:50051/",
                              "::1:50051", "a:-1", "a: 1", "a:1x", "a:99999999999999999999"}) {
    const Fault fault = fault_of(check_address(address));
    EXPECT_EQ(fault.reason, "ADDRESS_INVALID") << address;
    EXPECT_EQ(fault.element, address);
  }
}

}  // namespace
}  // namespace lpdeform::client
