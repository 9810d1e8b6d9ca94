#include "core/base/fault.h"

#include <cmath>
#include <utility>
#include <vector>

#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

constexpr char kPayloadUrl[] = "lpdeform.fault";

}  // namespace

absl::Status make_fault(NewFault fault, std::string_view text) {
  const absl::StatusCode code = code_of(fault.reason);
  return make_fault(code, std::move(fault), text);
}

absl::Status make_fault(absl::StatusCode code, NewFault fault, std::string_view text) {
  return carry_fault(
      code, {std::string(name_of(fault.reason)), std::move(fault.element), std::move(fault.limit)}, text);
}

std::string exact(double number) {
  std::string text = absl::StrCat(number);
  const auto reads_back = [&] {
    double read = 0;
    return std::isnan(number) || (absl::SimpleAtod(text, &read) && read == number);
  };
  for (int digits = 15; digits <= 17 && !reads_back(); ++digits)
    text = absl::StrFormat("%.*g", digits, number);
  return text;
}

Fault fault_of(const absl::Status& status) {
  const auto payload = status.GetPayload(kPayloadUrl);
  if (!payload.has_value()) return {};
  const std::string text(*payload);
  const std::vector<std::string> parts = absl::StrSplit(text, absl::MaxSplits('\n', 2));
  if (parts.size() != 3) return {};
  return {parts[0], parts[1], parts[2]};
}

bool operator==(std::string_view said, Reason reason) {
  return said == name_of(reason);
}

absl::Status carry_fault(absl::StatusCode code, const Fault& fault, std::string_view text) {
  absl::Status status(code, absl::string_view(text.data(), text.size()));
  status.SetPayload(kPayloadUrl,
                    absl::Cord(absl::StrCat(fault.reason, "\n", fault.element, "\n", fault.limit)));
  return status;
}

}  // namespace lpdeform
