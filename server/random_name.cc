#include "server/random_name.h"

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

}  // namespace lpdeform
