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
  std::chrono::milliseconds stays = std::chrono::seconds(1);     // at least, with whom it has just come to
  std::chrono::milliseconds patience = std::chrono::seconds(2);  // for one answer
  std::int64_t most_gone = 100'000;                              // names of sessions that were removed
};

/// A store in Redis that several servers share. A session is a hash with its parts, its epoch, who holds it and until when,
/// by Redis's clock: each change is a script that first looks whether the holder and the epoch are the right ones, so a
/// server that was stopped, cut off or slow changes nothing once another has taken over. What is durable is as durable as
/// Redis is set to make it (appendonly yes, appendfsync always).
///
/// A holder listens on a channel of its name. Where nobody does any more, its process has ended, and its sessions are free at once;
/// where a server is stopped or cut off, and Redis does not know, they are once the lease has. Who is taken for gone and is not, as its
/// connection broke, is fenced off as any other. A user of Redis who may not SUBSCRIBE is held by the lease alone.
///
/// A session that is wanted by the way of its callers is kept for who wants it first. Where two servers want it from each other
/// in turn, as behind proxies that know different sets of them, it stays twice as long each time, up to 32 times `stays`.
///
/// Nothing expires by Redis's clock, which goes on while Redis is away and while no server runs: use is dated by the time that
/// servers have run and reached Redis, and remove_unused() goes by it. A session that Redis has lost, or whose epoch is less than
/// its holder knows as kept, is told from one that was removed (kLost): the holder writes it anew, with its blobs. One that
/// was removed leaves behind that it was, and one that was removed as unused the epoch from which on it may be
/// written anew: by a holder that was cut off and has it in use, where nobody else had it since. The last `most_gone` are remembered,
/// some 200 bytes each; what a holder does not find that was last in touch before one that is forgotten counts as removed.
///
/// Keys: lpdeform:s:SESSION, a hash; lpdeform:b:KEY, a blob; lpdeform:u:KEY, the set of sessions that have it; lpdeform:m:SESSION,
/// of one that is being made, the set of its blobs' keys; lpdeform:r:OWNER:REQUEST, a session's name; lpdeform:o:OWNER, the sorted
/// set of an owner's sessions; lpdeform:used, that of all, by their last use; lpdeform:time, its clock; lpdeform:gone, the
/// sorted set of those that are gone, by when; lpdeform:gone:epochs, a hash of those that may be written anew. A
/// channel: lpdeform:h:HOLDER. Redis 7.0 or later.
///
/// UNAVAILABLE STORE_FAILING where Redis does not answer; later on the store finds it again by itself.
absl::StatusOr<std::shared_ptr<Store>> open_redis_store(const RedisStoreOptions& options);

}  // namespace lpdeform
