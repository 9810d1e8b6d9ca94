#include "server/runtime/random_name.h"

#include <sys/random.h>

#include <array>

#include "absl/strings/escaping.h"
#include "core/base/check.h"

namespace lpdeform {

std::string random_hex_128() {
  std::array<char, 16> bytes;
  LPDEFORM_CHECK(getentropy(bytes.data(), bytes.size()) == 0);
  return absl::BytesToHexString({bytes.data(), bytes.size()});
}

bool is_session_name(std::string_view text) {
  constexpr std::string_view kBefore = "sessions/";
  return text.size() == kBefore.size() + 32 && text.starts_with(kBefore) &&
         text.find_first_not_of("0123456789abcdef", kBefore.size()) == std::string_view::npos;
}

}  // namespace lpdeform
