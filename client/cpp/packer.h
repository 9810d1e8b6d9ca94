#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "lpdeform/v1/data.pb.h"

namespace lpdeform::client {

/// Puts arrays of numbers into the buffers of one message: inline as long as all of them together stay within
/// kInlineBytes, otherwise by an upload. So no message exceeds the limits of servers and clients.
class Packer {
 public:
  static constexpr std::size_t kInlineBytes = std::size_t{1} << 20;

  /// Uploads bytes before the message; returns the name by which a buffer refers to them.
  using Upload = std::function<absl::StatusOr<std::string>(std::string_view bytes)>;

  explicit Packer(Upload upload) : upload_(std::move(upload)) {}

  absl::Status pack(std::string bytes, v1::Buffer& into);

 private:
  Upload upload_;
  std::size_t left_ = kInlineBytes;
};

/// Numbers as little-endian bytes without gaps.
std::string bytes_of(std::span<const double> numbers);
std::string bytes_of(std::span<const std::uint32_t> numbers);

}  // namespace lpdeform::client
