#include "server/calls/options.h"

#include <algorithm>

#include "server/runtime/machine_memory.h"

namespace lpdeform {

std::size_t default_max_bytes() {
  return memory_of_process() / 4 * 3;
}

std::size_t caller_max_bytes(const ServerOptions& options) {
  const ByteLimit& limit = options.max_bytes_per_caller;
  if (limit.bytes) return *limit.bytes;
  return std::max<std::size_t>(
      1, static_cast<std::size_t>(static_cast<double>(options.max_bytes) * limit.percent / 100));
}

}  // namespace lpdeform
