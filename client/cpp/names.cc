#include "client/cpp/names.h"

#ifdef LPDEFORM_HAS_UTF8_RANGE
#include <utf8_validity.h>
#else
#include <google/protobuf/stubs/common.h>
#endif

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

bool is_utf8(std::string_view text) {
#ifdef LPDEFORM_HAS_UTF8_RANGE
  return utf8_range::IsStructurallyValid({text.data(), text.size()});
#else
  return google::protobuf::internal::IsStructurallyValidUTF8(text.data(), static_cast<int>(text.size()));
#endif
}

}  // namespace

absl::Status check_name(std::string_view what, std::string_view name) {
  if (is_utf8(name)) return absl::OkStatus();
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
