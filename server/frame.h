#pragma once

#include <atomic>
#include <bit>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "core/base/geometry.h"
#include "core/solve/settings.h"
#include "server/draw_mesh.h"

namespace lpdeform {

/// How positions and distortion travel.
enum class Scalar { kFloat32, kFloat64 };

std::size_t bytes_of(Scalar scalar);

/// The large part of a frame: shared by every stream that sends it, and by frames that differ in their
/// numbers alone. Immutable; the float32 form and the normals are made once, when first asked for.
/// Thread-safe.
class Surface {
 public:
  /// One row each a vertex of the client's. `mesh` knows the normals; null where nobody will ask for them.
  Surface(Points positions, Field cell_energies, std::shared_ptr<const DrawMesh> mesh = nullptr);

  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(positions_.rows()); }

  /// x, y, z of each vertex, packed, little-endian.
  std::string_view position_bytes(Scalar scalar) const;
  /// E_i of each vertex, packed, little-endian.
  std::string_view distortion_bytes(Scalar scalar) const;
  /// The normal of each vertex, packed, little-endian. Needs a mesh.
  std::string_view normal_bytes(Scalar scalar) const;
  /// Makes what these will be asked for, now and on this thread.
  void prepare(Scalar scalar, bool with_normals) const;

  const Points& positions() const { return positions_; }
  std::size_t memory_bytes() const;

 private:
  void make_float32() const;
  void make_normals() const;

  static_assert(std::endian::native == std::endian::little, "numbers travel as they lie in memory");

  const Points positions_;
  const Field cell_energies_;
  mutable std::once_flag once_;
  mutable std::string float32_positions_, float32_distortion_;
  const std::shared_ptr<const DrawMesh> mesh_;
  mutable std::once_flag normals_once_;
  mutable Points normals_;
  mutable std::string float32_normals_;
  mutable std::atomic<bool> has_normals_ = false;
};

/// One state of a session on its way to its readers. Meanings as in frame.proto.
struct Frame {
  std::uint64_t frame_seq = 0;
  std::uint64_t input_seq = 0;
  std::uint64_t epoch = 0;
  std::uint64_t taken = 0;  // inputs that this frame and those before it answer
  std::uint32_t iteration = 0;
  double energy = 0;
  double soft_energy = 0;  // the part of it that soft and orientation handles have
  bool converged = false;
  StopReason stop_reason = StopReason::kRunning;
  double solve_seconds = 0;
  Method method = Method::kAuto;
  std::shared_ptr<const Surface> surface;
};

/// A piece of a frame that fits into a message: vertices first to first + count - 1.
struct FramePiece {
  std::shared_ptr<const Frame> frame;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  bool is_last = false;
  std::uint64_t skipped_inputs = 0;
  Scalar scalar = Scalar::kFloat32;
  bool with_distortion = true;
  bool with_normals = false;
};

/// Cuts a frame into pieces of at most 1 MiB with everything around them.
class FrameCutter {
 public:
  FrameCutter() = default;
  FrameCutter(std::shared_ptr<const Frame> frame, Scalar scalar, bool with_distortion, bool with_normals,
              std::uint64_t skipped_inputs);

  bool has_more() const { return frame_ != nullptr; }
  /// Needs has_more(). Lets go of the frame with its last piece.
  FramePiece next();

  static constexpr std::size_t kMostBytes = (1u << 20) - 1024;  // the rest is for headers

 private:
  std::shared_ptr<const Frame> frame_;
  Scalar scalar_ = Scalar::kFloat32;
  bool with_distortion_ = true;
  bool with_normals_ = false;
  std::uint64_t skipped_inputs_ = 0;
  std::uint32_t at_ = 0;
};

}  // namespace lpdeform
