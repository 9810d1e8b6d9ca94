#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <string>

namespace lpdeform {

/// The number that starts at `bytes`, stored in the given byte order.
template <typename Number>
Number load(const char* bytes, std::endian order) {
  char ordered[sizeof(Number)];
  std::memcpy(ordered, bytes, sizeof(Number));
  if (order != std::endian::native) std::reverse(ordered, ordered + sizeof(Number));
  Number number;
  std::memcpy(&number, ordered, sizeof(Number));
  return number;
}

template <typename Number>
Number load_little_endian(const char* bytes) {
  return load<Number>(bytes, std::endian::little);
}

template <typename Number>
void append_little_endian(std::string& bytes, Number number) {
  char ordered[sizeof(Number)];
  std::memcpy(ordered, &number, sizeof(Number));
  if (std::endian::native != std::endian::little) std::reverse(ordered, ordered + sizeof(Number));
  bytes.append(ordered, sizeof(Number));
}

}  // namespace lpdeform
