#pragma once

#include <chrono>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store.h"

namespace lpdeform {

struct RedisStoreOptions {
  std::string host;
  int port = 6379;
  std::chrono::milliseconds idle =
      std::chrono::minutes(10);  // keys that nobody has touched for so long expire
  std::chrono::milliseconds lease = std::chrono::milliseconds(900);
  std::chrono::milliseconds stays = std::chrono::seconds(1);     // at least, with whom it has just come to
  std::chrono::milliseconds patience = std::chrono::seconds(2);  // for one answer
};

/// A store in Redis that several servers share. A session is a hash with its parts, its epoch, who holds it and until when,
/// by Redis's clock: each change is a script that first looks whether the holder and the epoch are the right ones, so a
/// server that was stopped, cut off or slow changes nothing once another has taken over. What is durable is as durable as
/// Redis is set to make it (appendonly yes, appendfsync always).
///
/// A session that is wanted by the way of its callers is kept for who wants it first. Where two servers want it from each other
/// in turn, as behind proxies that know different sets of them, it stays twice as long each time, up to 32 times `stays`.
///
/// Keys: lpdeform:s:SESSION, a hash; lpdeform:b:KEY, a blob, and lpdeform:u:KEY, the set of sessions that have it;
/// lpdeform:r:OWNER:REQUEST, a session's name. All expire after `idle` without a touch.
///
/// UNAVAILABLE STORE_FAILING where Redis does not answer; later on the store finds it again by itself.
absl::StatusOr<std::shared_ptr<Store>> open_redis_store(const RedisStoreOptions& options);

}  // namespace lpdeform
