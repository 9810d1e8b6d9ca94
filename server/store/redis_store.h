#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/redis_connection.h"
#include "server/store/store.h"

namespace lpdeform {

struct RedisStoreOptions {
  std::string host;
  int port = 6379;
  RedisLogin login = {};
  std::chrono::milliseconds lease = std::chrono::milliseconds(900);
  std::chrono::milliseconds stays = std::chrono::seconds(
      1);  // a session stays this long at least with a server that has just taken it over
  std::chrono::milliseconds patience = std::chrono::seconds(2);  // for one answer
  std::int64_t most_gone = 100'000;                              // how many removed sessions are remembered
};

/// A store in Redis that several servers share. A session is a hash with its parts, its epoch, its holder,
/// and the end of the holder's lease by Redis's clock. Each change is a script that first checks the holder
/// and the epoch (fencing). So a server that was stopped, cut off or slow changes nothing once another has
/// taken the session over. Data is as durable as Redis is configured to make it (appendonly yes, appendfsync
/// always).
///
/// A holder listens on a channel of its name. If nobody listens there any more, the holder's process has
/// ended, and its sessions are free at once. If a server is stopped or cut off without Redis knowing, its
/// sessions are free when the lease ends. A server that lost only its connection may be taken for ended; it
/// is then fenced like any other. A user of Redis who may not SUBSCRIBE holds sessions by the lease alone.
/// If no server reaches Redis for half of a lease, as when Redis or its disk hangs, leases that end meanwhile hold for one lease
/// after that, also where a holder has lost its connection. So a holder keeps its sessions through an outage, or through several
/// that begin within two leases after the end of the first. Where Redis is slow for longer, others may take them over.
///
/// If several servers want a session for callers of its route, the first of them gets it. If two servers want
/// it from each other in turn, as behind proxies that know different sets of servers, it stays twice as long
/// each time, up to 32 times `stays`.
///
/// Nothing expires by Redis's clock, because that clock goes on while Redis is away or no server runs. The
/// last use of a session is dated by the time that servers have run and reached Redis, and remove_unused()
/// compares with that. A session that Redis has lost, or whose epoch is lower than its holder knows as
/// stored, differs from a removed one (kLost): the holder writes it again, with its blobs. Of a removed
/// session Redis remembers the removal. If it was removed as unused, Redis also remembers the epoch from
/// which on it may be written again: by a holder that was cut off and has it in use, if no other server has
/// had it since. Redis remembers the last `most_gone` removals, about 200 bytes each. If a holder last heard
/// of its sessions before a removal that is forgotten, a session that it does not find counts as removed.
///
/// Keys: lpdeform:s:SESSION, a hash; lpdeform:b:KEY, a blob; lpdeform:u:KEY, the set of sessions that use the
/// blob; lpdeform:m:SESSION, for a session that is being made, the set of its blobs' keys;
/// lpdeform:r:OWNER:REQUEST, a session's name; lpdeform:o:OWNER, the sorted set of an owner's sessions;
/// lpdeform:used, the sorted set of all sessions by their last use; lpdeform:time, the clock of servers'
/// running time, and the last outage; lpdeform:gone, the sorted set of removed sessions, by when they were removed;
/// lpdeform:gone:epochs, a hash of those that may be written again. Channel: lpdeform:h:HOLDER. Redis 7.0 or
/// later.
///
/// UNAVAILABLE STORE_FAILING if Redis does not answer. If Redis fails later, the store reconnects by itself.
absl::StatusOr<std::shared_ptr<Store>> open_redis_store(const RedisStoreOptions& options);

}  // namespace lpdeform
