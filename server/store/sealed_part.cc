#include "server/store/sealed_part.h"

#include <cstdint>
#include <string_view>

#include "core/base/crc32c.h"
#include "server/store/store.h"

namespace lpdeform {
namespace {

std::uint32_t checksum(std::string_view session, std::string_view part, std::string_view value) {
  return crc32c(value, crc32c(part, crc32c(session)));
}

}  // namespace

std::string sealed(const std::string& session, const std::string& part, const std::string& value) {
  const std::uint32_t sum = checksum(session, part, value);
  std::string bytes;
  bytes.reserve(value.size() + 4);
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(sum >> shift));
  return bytes.append(value);
}

absl::StatusOr<std::string> unsealed(const std::string& session, const std::string& part, std::string bytes) {
  std::uint32_t sum = 0;
  for (std::size_t k = 0; k < 4 && k < bytes.size(); ++k)
    sum |= std::uint32_t{static_cast<unsigned char>(bytes[k])} << (8 * k);
  if (bytes.size() >= 4) {
    bytes.erase(0, 4);
    if (checksum(session, part, bytes) == sum) return bytes;
  }
  return session_damaged("a part of it has the wrong checksum", part);
}

}  // namespace lpdeform
