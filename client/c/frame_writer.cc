#include "client/c/frame_writer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "client/c/vertex_source.h"
#include "core/base/colour.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {
namespace {

constexpr double kMostUnsigned = 65535;

std::uint32_t bytes_of(lpdeform_format format, std::uint32_t components) {
  switch (format) {
    case LPDEFORM_FLOAT32:
      return components * sizeof(float);
    case LPDEFORM_FLOAT64:
      return components * sizeof(double);
    case LPDEFORM_UNORM16:
    case LPDEFORM_SNORM16:
      return 4 * sizeof(std::uint16_t);
    default:
      return 4;
  }
}

absl::Status check(const std::string& name, const lpdeform_target& target, std::uint32_t components,
                   std::initializer_list<lpdeform_format> formats, std::uint32_t vertex_count) {
  if (target.data == nullptr) return absl::OkStatus();
  const absl::Status reserved = check_reserved(name, target.reserved);
  if (!reserved.ok()) return reserved;
  if (std::ranges::find(formats, target.format) == formats.end()) {
    return make_fault({Reason::kFormatUnknown, name, ""},
                      absl::StrCat("Format ", target.format, " is not one of ", name, "."));
  }
  return check_extent(name, target.bytes, target.offset, target.stride, bytes_of(target.format, components),
                      vertex_count);
}

absl::Status absent(const std::string& what, Reason reason, const std::string& option) {
  return make_fault({reason, what, option}, absl::StrCat("Frames of this session have no ", what,
                                                         ": it was opened without (", option, ")."));
}

/// Writes value_of(i) to the place of vertex i, for all vertices.
template <typename ValueOf>
void write_all(const lpdeform_target& target, std::size_t count, ValueOf value_of) {
  using Value = decltype(value_of(std::size_t{0}));
  const std::size_t stride = target.stride == 0 ? sizeof(Value) : target.stride;
  auto* to = static_cast<unsigned char*>(target.data) + target.offset;
  for (std::size_t i = 0; i < count; ++i, to += stride) {
    const Value value = value_of(i);
    std::memcpy(to, &value, sizeof value);
  }
}

/// Converts triples of the server to triples of the engine: component k of the engine is factor[k] times component
/// from[k] of the server.
struct Turned {
  Turned(const std::vector<double>& numbers, const Space& space, double scale) : numbers(numbers.data()) {
    for (int k = 0; k < 3; ++k) {
      from[space.axis()[k]] = k;
      factor[space.axis()[k]] = space.sign()[k] * scale;
    }
  }
  double operator()(std::size_t i, int k) const { return factor[k] * numbers[3 * i + from[k]]; }

  const double* numbers;
  std::array<std::size_t, 3> from{};
  std::array<double, 3> factor{};
};

template <typename Number>
void write_triples(const Turned& triples, const lpdeform_target& target, std::size_t count) {
  write_all(target, count, [&](std::size_t i) {
    return std::array<Number, 3>{static_cast<Number>(triples(i, 0)), static_cast<Number>(triples(i, 1)),
                                 static_cast<Number>(triples(i, 2))};
  });
}

/// Sets the frame's origin and extent: its bounding box.
void measure(const Turned& positions, std::size_t count, lpdeform_frame& out) {
  for (int k = 0; k < 3; ++k) {
    double least = count == 0 ? 0 : positions(0, k), most = least;
    for (std::size_t i = 1; i < count; ++i) {
      least = std::min(least, positions(i, k));
      most = std::max(most, positions(i, k));
    }
    out.origin[k] = least;
    out.extent[k] = most - least;
  }
}

void write_normalised(const Turned& positions, const lpdeform_frame& box, const lpdeform_target& target,
                      std::size_t count) {
  std::array<double, 3> factor;
  for (int k = 0; k < 3; ++k) factor[k] = box.extent[k] > 0 ? kMostUnsigned / box.extent[k] : 0;
  write_all(target, count, [&](std::size_t i) {
    std::array<std::uint16_t, 4> out{0, 0, 0, 65535};
    for (int k = 0; k < 3; ++k) {
      out[k] = static_cast<std::uint16_t>((positions(i, k) - box.origin[k]) * factor[k] + 0.5);
    }
    return out;
  });
}

template <typename Integer>
void write_normals(const Turned& normals, const lpdeform_target& target, std::size_t count, double most) {
  write_all(target, count, [&](std::size_t i) {
    std::array<Integer, 4> out{};
    for (int k = 0; k < 3; ++k) {
      out[k] = static_cast<Integer>(std::lrint(std::clamp(normals(i, k), -1.0, 1.0) * most));
    }
    return out;
  });
}

using Colour = std::array<std::uint8_t, 4>;

constexpr std::size_t kShades = 1024;

const std::array<Colour, kShades>& shades() {
  static const auto table = [] {
    std::array<Colour, kShades> out;
    for (std::size_t k = 0; k < kShades; ++k) {
      const Rgb rgb = blue_to_red(static_cast<double>(k) / (kShades - 1));
      out[k] = {rgb[0], rgb[1], rgb[2], 255};
    }
    return out;
  }();
  return table;
}

void write_colours(const std::vector<double>& distortion, double red, const lpdeform_target& target) {
  const double factor = red > 0 ? (kShades - 1) / red : 0;
  const auto& table = shades();
  const auto colour_of = [&](std::size_t i) {
    return table[static_cast<std::size_t>(std::clamp(distortion[i] * factor + 0.5, 0.0, kShades - 1.0))];
  };
  if (target.format == LPDEFORM_FLOAT32) {
    write_all(target, distortion.size(), [&](std::size_t i) {
      const Colour colour = colour_of(i);
      return std::array<float, 4>{colour[0] / 255.0F, colour[1] / 255.0F, colour[2] / 255.0F, 1.0F};
    });
  } else if (target.format == LPDEFORM_BGRA8) {
    write_all(target, distortion.size(), [&](std::size_t i) {
      const Colour colour = colour_of(i);
      return Colour{colour[2], colour[1], colour[0], colour[3]};
    });
  } else {
    write_all(target, distortion.size(), colour_of);
  }
}

void write_positions(const Turned& positions, const lpdeform_target& target, std::size_t count,
                     lpdeform_frame& out) {
  if (target.data == nullptr) return;
  if (target.format == LPDEFORM_FLOAT32) return write_triples<float>(positions, target, count);
  if (target.format == LPDEFORM_FLOAT64) return write_triples<double>(positions, target, count);
  measure(positions, count, out);
  write_normalised(positions, out, target, count);
}

void write_normals(const Turned& normals, const lpdeform_target& target, std::size_t count) {
  if (target.data == nullptr) return;
  if (target.format == LPDEFORM_FLOAT32) return write_triples<float>(normals, target, count);
  if (target.format == LPDEFORM_FLOAT64) return write_triples<double>(normals, target, count);
  if (target.format == LPDEFORM_SNORM16) return write_normals<std::int16_t>(normals, target, count, 32767);
  write_normals<std::int8_t>(normals, target, count, 127);
}

void write_distortion(const std::vector<double>& distortion, const lpdeform_target& target) {
  if (target.data == nullptr) return;
  if (target.format == LPDEFORM_FLOAT64) {
    write_all(target, distortion.size(), [&](std::size_t i) { return distortion[i]; });
  } else {
    write_all(target, distortion.size(), [&](std::size_t i) { return static_cast<float>(distortion[i]); });
  }
}

double red_of(const client::Frame& frame, const lpdeform_buffers& buffers) {
  if (buffers.red_distortion > 0) return buffers.red_distortion;
  return distortion_of_red(Eigen::Map<const Field>(frame.distortion.data(), frame.distortion.size()));
}

lpdeform_frame facts_of(const client::Frame& frame) {
  lpdeform_frame out{};
  out.struct_size = sizeof out;
  out.vertex_count = static_cast<std::uint32_t>(frame.positions.size() / 3);
  out.input_seq = frame.input_seq;
  out.frame_seq = frame.frame_seq;
  out.epoch = frame.epoch;
  out.skipped_inputs = frame.skipped_inputs;
  out.iteration = frame.iteration;
  out.is_final = frame.is_final;
  out.stop_reason = static_cast<lpdeform_stop_reason>(frame.stop_reason);
  out.has_optimality_gap = frame.optimality_gap.has_value();
  out.energy = frame.energy;
  out.soft_energy = frame.soft_energy;
  out.solve_seconds = frame.solve_seconds;
  out.optimality_gap = frame.optimality_gap.value_or(0);
  return out;
}

}  // namespace

absl::Status check_buffers(const lpdeform_buffers& buffers, std::uint32_t vertex_count,
                           const FrameContents& contents) {
  if (buffers.normals.data != nullptr && !contents.normals)
    return absent("normals", Reason::kNoNormals, "with_normals");
  if ((buffers.colours.data != nullptr || buffers.distortion.data != nullptr) && !contents.distortion) {
    return absent("distortion", Reason::kNoDistortion, "without_distortion");
  }
  if (!std::isfinite(buffers.red_distortion) || buffers.red_distortion < 0) {
    return make_fault({Reason::kRedOutOfRange, "red_distortion", "0 <= red_distortion"},
                      absl::StrCat("red_distortion is ", buffers.red_distortion, "."));
  }
  absl::Status checked = check_reserved("buffers", buffers.reserved);
  checked.Update(check("positions", buffers.positions, 3,
                       {LPDEFORM_FLOAT32, LPDEFORM_FLOAT64, LPDEFORM_UNORM16}, vertex_count));
  checked.Update(check("normals", buffers.normals, 3,
                       {LPDEFORM_FLOAT32, LPDEFORM_FLOAT64, LPDEFORM_SNORM16, LPDEFORM_SNORM8},
                       vertex_count));
  checked.Update(
      check("colours", buffers.colours, 4, {LPDEFORM_FLOAT32, LPDEFORM_RGBA8, LPDEFORM_BGRA8}, vertex_count));
  checked.Update(
      check("distortion", buffers.distortion, 1, {LPDEFORM_FLOAT32, LPDEFORM_FLOAT64}, vertex_count));
  return checked;
}

lpdeform_frame write_frame(const client::Frame& frame, const Space& space, const lpdeform_buffers& buffers) {
  lpdeform_frame out = facts_of(frame);
  const std::size_t count = out.vertex_count;
  write_positions(Turned(frame.positions, space, space.units_per_metre()), buffers.positions, count, out);
  if (frame.normals.size() == frame.positions.size()) {
    write_normals(Turned(frame.normals, space, 1), buffers.normals, count);
  }
  if (frame.distortion.size() != count) return out;
  write_distortion(frame.distortion, buffers.distortion);
  if (buffers.colours.data != nullptr) {
    out.red_distortion = red_of(frame, buffers);
    write_colours(frame.distortion, out.red_distortion, buffers.colours);
  }
  return out;
}

}  // namespace lpdeform::engine
