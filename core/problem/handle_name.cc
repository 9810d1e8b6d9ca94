#include "core/problem/handle_name.h"

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestName = 128;

}  // namespace

std::string handle_element(std::string_view name) {
  return absl::StrCat("handle \"", std::string(name.substr(0, kLongestName)), "\"");
}

absl::Status check_handle_name(std::string_view name) {
  if (!name.empty() && name.size() <= kLongestName) return absl::OkStatus();
  return make_fault({Reason::kHandleName, handle_element(name), "1 to 128 bytes"},
                    absl::StrCat("a handle's name has ", name.size(), " bytes; it must have 1 to 128"));
}

}  // namespace lpdeform
