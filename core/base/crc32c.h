#pragma once

#include <cstdint>
#include <string_view>

namespace lpdeform {

/// CRC-32C (Castagnoli, reflected polynomial 0x82f63b78) of `bytes`: the checksum of uploads. For bytes that arrive in
/// parts, pass the result so far as `previous`: crc32c(b, crc32c(a)) is the checksum of a followed by b. The checksum
/// of no bytes is 0.
std::uint32_t crc32c(std::string_view bytes, std::uint32_t previous = 0);

}  // namespace lpdeform
