#include "client/c/error.h"

#include <cstring>
#include <string>
#include <string_view>

#include "client/c/structs.h"
#include "core/base/fault.h"

namespace lpdeform::engine {
namespace {

constexpr std::string_view kCut = "...";

/// As much as there is room for, never half a UTF-8 character.
template <std::size_t size>
void copy_text(std::string_view text, char (&into)[size]) {
  if (text.size() < size) {
    std::memcpy(into, text.data(), text.size());
    into[text.size()] = '\0';
    return;
  }
  std::size_t length = size - 1 - kCut.size();
  while (length > 0 && (static_cast<unsigned char>(text[length]) & 0xC0) == 0x80) --length;
  std::memcpy(into, text.data(), length);
  std::memcpy(into + length, kCut.data(), kCut.size());
  into[length + kCut.size()] = '\0';
}

}  // namespace

lpdeform_code tell(const absl::Status& status, lpdeform_error* error) {
  const auto code = static_cast<lpdeform_code>(status.code());
  if (error == nullptr) return code;
  lpdeform_error out{};
  out.code = code;
  const Fault fault = fault_of(status);
  copy_text(fault.reason, out.reason);
  copy_text(fault.element, out.element);
  copy_text(fault.limit, out.limit);
  copy_text(std::string(status.message()), out.message);
  write_struct(out, error);
  return code;
}

}  // namespace lpdeform::engine
