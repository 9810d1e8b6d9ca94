#include "core/base/crc32c.h"

#include <array>
#include <cstddef>

namespace lpdeform {
namespace {

constexpr std::uint32_t kPolynomial = 0x82f63b78;
constexpr std::size_t kSlices = 8;

using Tables = std::array<std::array<std::uint32_t, 256>, kSlices>;

/// tables[k][b]: the change of the remainder by byte b when k more bytes follow it.
constexpr Tables make_tables() {
  Tables tables{};
  for (std::uint32_t byte = 0; byte < 256; ++byte) {
    std::uint32_t remainder = byte;
    for (int bit = 0; bit < 8; ++bit) remainder = (remainder >> 1) ^ ((remainder & 1) ? kPolynomial : 0);
    tables[0][byte] = remainder;
  }
  for (std::size_t slice = 1; slice < kSlices; ++slice) {
    for (std::size_t byte = 0; byte < 256; ++byte) {
      const std::uint32_t before = tables[slice - 1][byte];
      tables[slice][byte] = (before >> 8) ^ tables[0][before & 0xff];
    }
  }
  return tables;
}

constexpr Tables kTables = make_tables();

std::uint32_t byte_at(std::string_view bytes, std::size_t index) {
  return static_cast<unsigned char>(bytes[index]);
}

}  // namespace

std::uint32_t crc32c(std::string_view bytes, std::uint32_t previous) {
  std::uint32_t remainder = ~previous;
  while (bytes.size() >= kSlices) {
    std::uint32_t next = 0;
    for (std::size_t k = 0; k < kSlices; ++k) {
      const std::uint32_t carried = k < 4 ? (remainder >> (8 * k)) & 0xff : 0;
      next ^= kTables[kSlices - 1 - k][byte_at(bytes, k) ^ carried];
    }
    remainder = next;
    bytes.remove_prefix(kSlices);
  }
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    remainder = (remainder >> 8) ^ kTables[0][(remainder ^ byte_at(bytes, k)) & 0xff];
  }
  return ~remainder;
}

}  // namespace lpdeform
