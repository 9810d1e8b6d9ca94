#include "server/store/redis_figures.h"

#include <map>
#include <string_view>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"

namespace lpdeform {

StoreFigures redis_figures(const std::string& info) {
  std::map<std::string, std::string> said;
  for (const auto line : absl::StrSplit(info, absl::ByAnyChar("\r\n"), absl::SkipEmpty())) {
    const std::pair<std::string, std::string> pair = absl::StrSplit(line, absl::MaxSplits(':', 1));
    said.insert(pair);
  }
  const auto number = [&](const char* name) {
    double value = 0;
    const auto found = said.find(name);
    return found != said.end() && absl::SimpleAtod(found->second, &value) ? value : 0;
  };
  const auto is = [&](const char* name, std::string_view value) {
    const auto found = said.find(name);
    return found != said.end() && found->second == value;
  };
  StoreFigures figures;
  figures.memory_bytes = number("used_memory");
  figures.memory_limit_bytes = number("maxmemory");
  figures.evicted = number("evicted_keys");
  figures.clients = number("connected_clients");
  figures.clients_refused = number("rejected_connections");
  figures.replicas = number("connected_slaves");
  figures.syncs_delayed = number("aof_delayed_fsync");
  figures.is_in_memory_alone = is("aof_enabled", "0");
  figures.is_persistence_failing =
      is("aof_last_write_status", "err") || is("aof_last_bgrewrite_status", "err");
  return figures;
}

}  // namespace lpdeform
