#include "client/c/error.h"

#include <string>
#include <string_view>

#include "client/c/structs.h"
#include "core/base/fault.h"

namespace lpdeform::engine {
namespace {

constexpr std::string_view kCut = "...";

}  // namespace

void copy_text(std::string_view text, char* into, std::size_t size) {
  if (size == 0) return;
  std::size_t length = text.size();
  const std::string_view end = length < size ? "" : kCut.substr(0, size - 1);
  if (length >= size) length = size - 1 - end.size();
  while (length > 0 && length < text.size() && (static_cast<unsigned char>(text[length]) & 0xC0) == 0x80)
    --length;
  text.copy(into, length);
  end.copy(into + length, end.size());
  into[length + end.size()] = '\0';
}

lpdeform_code tell(const absl::Status& status, lpdeform_error* error) {
  const auto code = static_cast<lpdeform_code>(status.code());
  if (error == nullptr) return code;
  lpdeform_error out{};
  out.code = code;
  const Fault fault = fault_of(status);
  copy_text(fault.reason, out.reason, sizeof out.reason);
  copy_text(fault.element, out.element, sizeof out.element);
  copy_text(fault.limit, out.limit, sizeof out.limit);
  copy_text(std::string(status.message()), out.message, sizeof out.message);
  write_struct(out, error);
  return code;
}

}  // namespace lpdeform::engine
