#include "server/store/redis_figures.h"

#include <gtest/gtest.h>

namespace lpdeform {
namespace {

TEST(RedisFigures, AreWhatItSaysOfItself) {
  const StoreFigures figures = redis_figures(
      "# Clients\r\nconnected_clients:7\r\n# Memory\r\nused_memory:1048576\r\nmaxmemory:2147483648\r\n"
      "# Persistence\r\naof_enabled:1\r\naof_last_write_status:ok\r\naof_last_bgrewrite_status:err\r\n"
      "aof_delayed_fsync:3\r\n# Stats\r\nevicted_keys:4\r\nrejected_connections:5\r\n# Replication\r\n"
      "connected_slaves:2\r\n");
  EXPECT_EQ(figures.clients, 7);
  EXPECT_EQ(figures.memory_bytes, 1048576);
  EXPECT_EQ(figures.memory_limit_bytes, 2147483648.0);
  EXPECT_EQ(figures.syncs_delayed, 3);
  EXPECT_EQ(figures.evicted, 4);
  EXPECT_EQ(figures.clients_refused, 5);
  EXPECT_EQ(figures.replicas, 2);
  EXPECT_FALSE(figures.is_in_memory_alone);
  EXPECT_TRUE(figures.is_persistence_failing);
}

TEST(RedisFigures, OfAnAnswerThatIsNoneAreNothing) {
  for (const char* const said : {"", "used_memory", "used_memory:much\r\n:\r\n::\r\n"}) {
    const StoreFigures figures = redis_figures(said);
    EXPECT_EQ(figures.memory_bytes, 0) << said;
    EXPECT_FALSE(figures.is_in_memory_alone) << said;
  }
  EXPECT_TRUE(redis_figures("aof_enabled:0").is_in_memory_alone);
}

}  // namespace
}  // namespace lpdeform
