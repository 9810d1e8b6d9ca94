#pragma once

#include <cstdint>
#include <optional>

#include "absl/status/statusor.h"
#include "client/cpp/types.h"
#include "lpdeform/v1/frame.pb.h"

namespace lpdeform::client {

/// Assembles frames from their parts. Not thread-safe.
class FrameAssembly {
 public:
  /// `vertex_count`: of the mesh. Every frame must have this many, so that a server cannot make the client allocate
  /// arbitrary memory.
  explicit FrameAssembly(std::uint32_t vertex_count) : vertex_count_(vertex_count) {}

  /// The frame that `part` completes; empty while parts are missing. DATA_LOSS (FRAME_PARTS) if the parts do not fit
  /// together; the incomplete frame is then dropped.
  absl::StatusOr<std::optional<Frame>> add(const v1::FramePart& part);

 private:
  absl::Status begin(const v1::FrameHeader& header);
  absl::Status append(const v1::FramePart& part);
  bool append_raw(const v1::FramePart& part);
  bool append_quantized(const v1::FramePart& part);

  std::uint32_t vertex_count_;
  std::optional<Frame> frame_;
  std::uint32_t received_ = 0;
  std::size_t scalar_bytes_ = 0;
  v1::Encoding encoding_ = v1::ENCODING_RAW;
  v1::Quantization quantization_;
};

}  // namespace lpdeform::client
