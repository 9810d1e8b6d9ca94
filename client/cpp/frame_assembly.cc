#include "client/cpp/frame_assembly.h"

#include <meshoptimizer.h>

#include <array>
#include <cstring>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cpp/wire.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

absl::Status misfit(std::string_view text) {
  return make_fault({Reason::kFrameParts, "", ""}, text);
}

/// Appends little-endian numbers of type Wire to `out`.
template <typename Wire, typename T>
void append_numbers(const std::string& bytes, std::vector<T>& out) {
  const std::size_t count = bytes.size() / sizeof(Wire);
  for (std::size_t k = 0; k < count; ++k) {
    Wire number;
    std::memcpy(&number, bytes.data() + k * sizeof(Wire), sizeof(Wire));
    out.push_back(number);
  }
}

/// Four 16-bit integers for each of `count` vertices; empty if `bytes` has another size or cannot be decoded.
template <typename Integer>
std::vector<std::array<Integer, 4>> quantized(const std::string& bytes, std::size_t count,
                                              bool is_compressed) {
  if (count == 0) return {};
  std::vector<std::array<Integer, 4>> out(count);
  constexpr std::size_t size = sizeof(out[0]);
  if (is_compressed) {
    const auto* const block = reinterpret_cast<const unsigned char*>(bytes.data());
    if (meshopt_decodeVertexBuffer(out.data(), count, size, block, bytes.size()) != 0) out.clear();
  } else if (bytes.size() == count * size) {
    std::memcpy(out.data(), bytes.data(), bytes.size());
  } else {
    out.clear();
  }
  return out;
}

constexpr double kMostUnsigned = 65535, kMostSigned = 32767;

}  // namespace

absl::StatusOr<std::optional<Frame>> FrameAssembly::add(const v1::FramePart& part) {
  absl::Status taken;
  if (part.has_header()) taken = begin(part.header());
  if (taken.ok()) taken = append(part);
  if (!taken.ok()) {
    frame_.reset();
    return taken;
  }
  if (!part.last()) return std::nullopt;
  return std::exchange(frame_, std::nullopt);
}

absl::Status FrameAssembly::begin(const v1::FrameHeader& header) {
  if (header.vertex_count() != vertex_count_) {
    return misfit(
        absl::StrCat("A frame has ", header.vertex_count(), " vertices, the mesh ", vertex_count_, "."));
  }
  Frame& frame = frame_.emplace();
  frame.input_seq = header.input_seq();
  frame.frame_seq = header.frame_seq();
  frame.epoch = header.epoch();
  frame.skipped_inputs = header.skipped_inputs();
  frame.iteration = header.iteration();
  frame.energy = header.energy();
  frame.soft_energy = header.soft_energy();
  frame.is_final = header.is_final();
  frame.stop_reason = from_wire(header.stop_reason());
  frame.solve_seconds = header.solve_seconds();
  frame.method = method_name(header.method());
  if (header.has_certificate()) frame.optimality_gap = header.certificate().relative_gap();
  frame.positions.reserve(std::size_t{3} * vertex_count_);
  frame.distortion.reserve(vertex_count_);
  received_ = 0;
  quantization_ = header.quantization();
  encoding_ = header.encoding() == v1::ENCODING_UNSPECIFIED ? v1::ENCODING_RAW : header.encoding();
  if (encoding_ > v1::ENCODING_COMPRESSED) {
    return misfit(absl::StrCat("A frame comes in encoding ", static_cast<int>(encoding_),
                               ", which was not asked for."));
  }
  scalar_bytes_ = header.scalar() == v1::SCALAR_FLOAT64 ? sizeof(double) : sizeof(float);
  return absl::OkStatus();
}

absl::Status FrameAssembly::append(const v1::FramePart& part) {
  if (!frame_ || part.frame_seq() != frame_->frame_seq || part.first_vertex() != received_ ||
      part.vertex_count() > vertex_count_ - received_) {
    return misfit(absl::StrCat("The part of frame ", part.frame_seq(), " from vertex ", part.first_vertex(),
                               " on does not follow what came before."));
  }
  const bool fits = encoding_ == v1::ENCODING_RAW ? append_raw(part) : append_quantized(part);
  if (!fits) {
    return misfit(absl::StrCat("A part of frame ", part.frame_seq(), " has the wrong number of bytes for ",
                               part.vertex_count(), " vertices."));
  }
  received_ += part.vertex_count();
  if (part.last() && received_ != vertex_count_) {
    return misfit(absl::StrCat("Frame ", part.frame_seq(), " ends after ", received_, " of ", vertex_count_,
                               " vertices."));
  }
  const auto is_none_or_all = [](std::size_t size, std::size_t all) { return size == 0 || size == all; };
  if (part.last() && (!is_none_or_all(frame_->distortion.size(), vertex_count_) ||
                      !is_none_or_all(frame_->normals.size(), std::size_t{3} * vertex_count_))) {
    return misfit(
        absl::StrCat("Frame ", part.frame_seq(), " has distortion or normals for a part of its vertices."));
  }
  return absl::OkStatus();
}

bool FrameAssembly::append_raw(const v1::FramePart& part) {
  const std::size_t count = part.vertex_count();
  const bool has_distortion = !part.distortion().empty();
  const bool has_normals = !part.normals().empty();
  if (part.positions().size() != 3 * count * scalar_bytes_ ||
      (has_normals && part.normals().size() != 3 * count * scalar_bytes_) ||
      (has_distortion && part.distortion().size() != count * scalar_bytes_)) {
    return false;
  }
  if (scalar_bytes_ == sizeof(double)) {
    append_numbers<double>(part.positions(), frame_->positions);
    append_numbers<double>(part.distortion(), frame_->distortion);
    append_numbers<double>(part.normals(), frame_->normals);
  } else {
    append_numbers<float>(part.positions(), frame_->positions);
    append_numbers<float>(part.distortion(), frame_->distortion);
    append_numbers<float>(part.normals(), frame_->normals);
  }
  return true;
}

bool FrameAssembly::append_quantized(const v1::FramePart& part) {
  const std::size_t count = part.vertex_count();
  const bool is_compressed = encoding_ == v1::ENCODING_COMPRESSED;
  const auto vertices = quantized<std::uint16_t>(part.positions(), count, is_compressed);
  if (vertices.size() != count) return false;
  const v1::Vector3& origin = quantization_.origin();
  const v1::Vector3& extent = quantization_.extent();
  const double dx = extent.x() / kMostUnsigned, dy = extent.y() / kMostUnsigned,
               dz = extent.z() / kMostUnsigned;
  const double step = quantization_.distortion_extent() / kMostUnsigned;
  for (const auto& [x, y, z, distortion] : vertices) {
    frame_->positions.push_back(x * dx + origin.x());
    frame_->positions.push_back(y * dy + origin.y());
    frame_->positions.push_back(z * dz + origin.z());
    frame_->distortion.push_back(distortion * step);
  }
  if (part.normals().empty()) return true;
  const auto normals = quantized<std::int16_t>(part.normals(), count, is_compressed);
  for (const auto& [x, y, z, none] : normals) {
    for (const std::int16_t component : {x, y, z}) frame_->normals.push_back(component / kMostSigned);
  }
  return normals.size() == count;
}

}  // namespace lpdeform::client
