#include "client/c/arguments.h"

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {

absl::Status argument_missing(const std::string& name) {
  return make_fault({Reason::kArgumentMissing, name, ""}, absl::StrCat(name, " is NULL."));
}

absl::Status check_enum(const std::string& name, std::int32_t value, std::int32_t most) {
  if (value >= 0 && value <= most) return absl::OkStatus();
  return make_fault({Reason::kEnumUnknown, name, absl::StrCat("0 <= ", name, " <= ", most)},
                    absl::StrCat(name, " is ", value, ", which this library does not know."));
}

absl::Status check_reserved(const std::string& name, std::uint32_t value) {
  if (value == 0) return absl::OkStatus();
  return make_fault({Reason::kReservedSet, name, "reserved = 0"},
                    absl::StrCat("A reserved field of ", name, " is ", value, " and not 0."));
}

}  // namespace lpdeform::engine
