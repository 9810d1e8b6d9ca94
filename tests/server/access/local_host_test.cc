#include "server/access/local_host.h"

#include <gtest/gtest.h>

#include <string>

namespace lpdeform {
namespace {

TEST(LocalHostTest, ThisMachinesNamesAndAddressesAreItsOwnWithAnyPort) {
  for (const char* authority :
       {"localhost", "localhost:8080", "LocalHost:1", "localhost.", "app.localhost:8080", "127.0.0.1",
        "127.0.0.1:50051", "127.1.2.3", "[::1]", "[::1]:8080"}) {
    EXPECT_TRUE(names_this_machine(authority)) << authority;
  }
}

TEST(LocalHostTest, OthersAreNot) {
  for (const char* authority : {"", ":8080", "evil.example", "evil.example:8080", "localhost.evil.example",
                                "notlocalhost", "localhost:x", "127.0.0.1.evil.example:8080",
                                "127.0.0.1@evil.example", "127.0.0.1:80:80", "128.0.0.1", "0.0.0.0:8080",
                                "192.168.1.5:8080", "[::2]", "[::ffff:10.0.0.1]:80", "::1", "lpdeform"}) {
    EXPECT_FALSE(names_this_machine(authority)) << authority;
  }
  EXPECT_FALSE(names_this_machine(std::string(100'000, 'a') + ".localhost"));
}

}  // namespace
}  // namespace lpdeform
