#include "server/store/open_store.h"

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/store/redis_store.h"
#include "server/store/sqlite_store.h"

namespace lpdeform {

absl::StatusOr<std::shared_ptr<Store>> open_store(const std::string& name, const StoreOptions& options) {
  static const std::string kSqlite = "sqlite:", kRedis = "redis://";
  if (!options.login.password_file.empty() && !absl::StartsWith(name, "redis")) {
    return make_fault({Reason::kOptionOutOfRange, "store_password_file", "--store redis://HOST:PORT"},
                      "Option --store-password-file is for --store redis://HOST:PORT.");
  }
  if (options.most_bytes != 0 && !absl::StartsWith(name, kSqlite)) {
    return make_fault(
        {Reason::kOptionOutOfRange, "max_store_bytes", "--store sqlite:DIR"},
        "Option --max-store-bytes is for --store sqlite:DIR; Redis has a maxmemory of its own.");
  }
  if (name == "none") return nullptr;
  if (absl::StartsWith(name, kSqlite) && name.size() > kSqlite.size()) {
    return open_sqlite_store({name.substr(kSqlite.size()), options.most_bytes});
  }
  // A password in the address, as other programs take it, must not appear in the error.
  if (absl::StartsWith(name, "redis") && absl::StrContains(name, '@')) {
    return make_fault({Reason::kOptionOutOfRange, "store", "redis://HOST:PORT"},
                      "Option --store takes no user and no password: give them as --store-user and "
                      "--store-password-file.");
  }
  std::uint32_t port = 0;
  const std::size_t colon = name.rfind(':');
  if (absl::StartsWith(name, kRedis) && colon > kRedis.size() &&
      absl::SimpleAtoi(name.substr(colon + 1), &port) && port >= 1 && port <= 65535) {
    return open_redis_store(
        {name.substr(kRedis.size(), colon - kRedis.size()), static_cast<int>(port), options.login});
  }
  const std::string known = "none, sqlite:DIR or redis://HOST:PORT";
  return make_fault({Reason::kOptionOutOfRange, "store", known},
                    absl::StrCat("Option --store must be ", known, ", not '", name, "'."));
}

}  // namespace lpdeform
