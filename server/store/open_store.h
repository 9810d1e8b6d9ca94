#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/redis_connection.h"
#include "server/store/store.h"

namespace lpdeform {

struct StoreOptions {
  std::uint64_t most_bytes = 0;  // of SQLite; 0: without limit
  RedisLogin login = {};         // of Redis
};

/// Opens the store that an operator names: "none" gives null; "sqlite:DIR"; "redis://HOST:PORT". Errors:
/// INVALID_ARGUMENT OPTION_OUT_OF_RANGE; UNAVAILABLE STORE_FAILING.
absl::StatusOr<std::shared_ptr<Store>> open_store(const std::string& name, const StoreOptions& options);

}  // namespace lpdeform
