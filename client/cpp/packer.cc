#include "client/cpp/packer.h"

#include <bit>
#include <utility>

namespace lpdeform::client {
namespace {

static_assert(std::endian::native == std::endian::little, "numbers go onto the wire as they lie in memory");

template <typename T>
std::string raw_bytes(std::span<const T> numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size_bytes()};
}

}  // namespace

absl::Status Packer::pack(std::string bytes, v1::Buffer& into) {
  if (bytes.size() <= left_) {
    left_ -= bytes.size();
    into.set_inline_(std::move(bytes));
    return absl::OkStatus();
  }
  absl::StatusOr<std::string> name = upload_(bytes);
  if (!name.ok()) return name.status();
  into.set_upload(*std::move(name));
  return absl::OkStatus();
}

std::string bytes_of(std::span<const double> numbers) {
  return raw_bytes(numbers);
}

std::string bytes_of(std::span<const std::uint32_t> numbers) {
  return raw_bytes(numbers);
}

}  // namespace lpdeform::client
