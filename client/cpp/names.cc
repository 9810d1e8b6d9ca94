#include "client/cpp/names.h"

#include <google/protobuf/stubs/common.h>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {

absl::Status check_name(std::string_view what, std::string_view name) {
  const int size = static_cast<int>(name.size());
  if (google::protobuf::internal::IsStructurallyValidUTF8(name.data(), size)) return absl::OkStatus();
  const std::string kind(what);
  const std::string shown = absl::StrCat(kind, " \"", absl::CHexEscape(std::string(name)), "\"");
  return make_fault({Reason::kNameEncoding, shown, "UTF-8"},
                    absl::StrCat("The name of ", shown, " is not UTF-8."));
}

absl::Status check_names(const Update& update) {
  for (const auto& [name, change] : update.handles) {
    absl::Status checked = check_name("handle", name);
    if (!checked.ok()) return checked;
  }
  return absl::OkStatus();
}

}  // namespace lpdeform::client
