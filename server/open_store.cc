#include "server/open_store.h"

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "server/sqlite_store.h"

namespace lpdeform {

absl::StatusOr<std::shared_ptr<Store>> open_store(const std::string& name, const StoreLimits& limits) {
  static const std::string kSqlite = "sqlite:";
  if (name == "none") return nullptr;
  if (absl::StartsWith(name, kSqlite) && name.size() > kSqlite.size()) {
    return open_sqlite_store({name.substr(kSqlite.size()), limits.most_bytes});
  }
  return invalid_input({"OPTION_OUT_OF_RANGE", "store", "none or sqlite:DIR"},
                       absl::StrCat("Option --store must be none or sqlite:DIR, not '", name, "'."));
}

}  // namespace lpdeform
