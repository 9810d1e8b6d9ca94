#pragma once

#include <atomic>
#include <bit>
#include <chrono>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/geometry.h"
#include "core/problem/settings.h"
#include "server/session/draw_mesh.h"
#include "server/session/quantize.h"

namespace lpdeform {

/// How numbers lie in memory.
enum class Scalar { kFloat32, kFloat64 };

std::size_t bytes_of(Scalar scalar);

/// The formats of positions, distortion and normals, from the most precise to the smallest.
enum class Format { kFloat64, kFloat32, kQuantized, kCompressed };

Format format_of(Scalar scalar);

/// The large part of a frame. It is shared by all streams that send it, and by frames that differ only in
/// their scalars. Immutable. Every form but float64 is made once, when it is first used. Thread-safe.
class Surface {
 public:
  /// One row per vertex of the client. `mesh` computes the normals; null if no normals will be needed.
  Surface(Points positions, Field cell_energies, std::shared_ptr<const DrawMesh> mesh = nullptr);

  std::uint32_t vertex_count() const { return static_cast<std::uint32_t>(positions_.rows()); }

  /// Bytes of the vertices `first` to `first + count - 1`, laid out as in frame.proto.
  struct Bytes {
    std::string_view positions, distortion, normals;
    std::size_t size() const { return positions.size() + distortion.size() + normals.size(); }
  };
  /// `first` must be a multiple of vertices_a_part(). `count` must be vertices_a_part(), or reach to the last
  /// vertex. Normals need a mesh.
  Bytes bytes(Format format, std::uint32_t first, std::uint32_t count, bool with_distortion,
              bool with_normals) const;
  /// How many vertices fit into a message.
  static std::uint32_t vertices_a_part(Format format, bool with_distortion, bool with_normals);
  /// Size of the whole surface in this format; for kCompressed the size before compression.
  std::size_t size(Format format, bool with_distortion, bool with_normals) const;
  /// Only for a quantized format.
  const Quantization& quantization() const;
  /// Makes the form that bytes() will need, now and on this thread.
  void prepare(Format format, bool with_normals) const;

  const Points& positions() const { return positions_; }
  std::size_t memory_bytes() const;

 private:
  struct Float32 {
    Eigen::VectorXf positions, distortion;
  };
  struct Quantized {
    Quantization quantization;
    std::string vertices;
  };
  using Parts = std::vector<std::string>;  // one block per part

  /// One form of the surface. The first caller of get() makes it; later calls only read it.
  template <typename Value>
  class Form {
   public:
    template <typename Make>
    const Value& get(const Make& make) const {
      std::call_once(once_, [&] { value_ = make(); });
      return value_;
    }

   private:
    mutable std::once_flag once_;
    mutable Value value_;
  };

  static_assert(std::endian::native == std::endian::little, "numbers travel as they lie in memory");

  const Float32& float32() const;
  const Quantized& quantized() const;
  const Parts& compressed() const;
  const Points& normals() const;
  const Eigen::VectorXf& float32_normals() const;
  const std::string& quantized_normals() const;
  const Parts& compressed_normals() const;
  std::string counted(std::string form) const;
  Eigen::VectorXf counted(Eigen::VectorXf form) const;
  Parts counted(Parts form) const;

  const Points positions_;
  const Field cell_energies_;
  const std::shared_ptr<const DrawMesh> mesh_;
  mutable std::atomic<std::size_t> form_bytes_ = 0;
  Form<Float32> float32_;
  Form<Quantized> quantized_;
  Form<Parts> compressed_;
  Form<Points> normals_;
  Form<Eigen::VectorXf> float32_normals_;
  Form<std::string> quantized_normals_;
  Form<Parts> compressed_normals_;
};

/// One state of a session on its way to its readers. The fields mean the same as in frame.proto.
struct Frame {
  std::uint64_t frame_seq = 0;
  std::uint64_t input_seq = 0;
  std::uint64_t epoch = 0;
  std::uint64_t taken = 0;  // how many inputs this frame and all before it answer
  std::uint32_t iteration = 0;
  double energy = 0;
  double soft_energy = 0;  // the part of the energy that soft and orientation handles have
  bool is_final = false;
  StopReason stop_reason = StopReason::kRunning;
  double solve_seconds = 0;
  Method method = Method::kAuto;
  std::optional<double> optimality_gap;  // of a final state, once it is known
  std::uint64_t repeats = 0;             // frame_seq of the same state before its gap was known; 0: none
  std::chrono::steady_clock::time_point published_at;
  std::shared_ptr<const Surface> surface;
};

/// A piece of a frame that fits into a message: the vertices `first` to `first + count - 1`.
struct FramePiece {
  std::shared_ptr<const Frame> frame;
  std::uint32_t first = 0;
  std::uint32_t count = 0;
  bool is_last = false;
  std::uint64_t skipped_inputs = 0;
  Format format = Format::kFloat32;
  bool with_distortion = true;
  bool with_normals = false;
  bool with_certificate = false;

  Surface::Bytes bytes() const {
    return frame->surface->bytes(format, first, count, with_distortion, with_normals);
  }
};

/// Cuts a frame into pieces that stay within 1 MiB, headers included.
class FrameCutter {
 public:
  FrameCutter() = default;
  FrameCutter(std::shared_ptr<const Frame> frame, Format format, bool with_distortion, bool with_normals,
              std::uint64_t skipped_inputs, bool with_certificate = false);

  bool has_more() const { return frame_ != nullptr; }
  /// The next piece. Call it only if has_more(). The cutter releases the frame with its last piece.
  FramePiece next();

 private:
  std::shared_ptr<const Frame> frame_;
  Format format_ = Format::kFloat32;
  bool with_distortion_ = true;
  bool with_normals_ = false;
  bool with_certificate_ = false;
  std::uint64_t skipped_inputs_ = 0;
  std::uint32_t at_ = 0;
};

}  // namespace lpdeform
