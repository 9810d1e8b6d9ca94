#include "client/cpp/frame_assembly.h"

#include <gtest/gtest.h>

#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

template <typename T>
std::string bytes(const std::vector<T>& numbers) {
  return {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(T)};
}

v1::FramePart part(std::uint32_t first, std::vector<float> positions, bool last) {
  v1::FramePart part;
  part.set_frame_seq(7);
  part.set_first_vertex(first);
  part.set_vertex_count(static_cast<std::uint32_t>(positions.size() / 3));
  part.set_positions(bytes(positions));
  part.set_distortion(bytes(std::vector<float>(positions.size() / 3, 0.5f)));
  part.set_last(last);
  return part;
}

v1::FramePart first_part(std::uint32_t vertex_count, std::vector<float> positions, bool last) {
  v1::FramePart first = part(0, std::move(positions), last);
  first.mutable_header()->set_frame_seq(7);
  first.mutable_header()->set_input_seq(3);
  first.mutable_header()->set_vertex_count(vertex_count);
  first.mutable_header()->set_is_final(true);
  return first;
}

TEST(FrameAssembly, PutsPartsTogetherInOrder) {
  FrameAssembly assembly(3);
  const auto none = assembly.add(first_part(3, {1, 2, 3}, false));
  ASSERT_TRUE(none.ok());
  EXPECT_FALSE(none->has_value());
  const auto frame = assembly.add(part(1, {4, 5, 6, 7, 8, 9}, true));
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->positions, (std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
  EXPECT_EQ((*frame)->distortion, (std::vector<double>{0.5, 0.5, 0.5}));
  EXPECT_EQ((*frame)->input_seq, 3u);
  EXPECT_TRUE((*frame)->is_final);
}

TEST(FrameAssembly, RefusesDistortionAndNormalsOfAPartOfTheVertices) {
  for (const bool is_first : {true, false}) {
    for (const bool is_distortion : {true, false}) {
      std::vector<v1::FramePart> parts{first_part(2, {1, 2, 3}, false), part(1, {4, 5, 6}, true)};
      v1::FramePart& other = parts[is_first ? 0 : 1];
      if (is_distortion) other.clear_distortion();
      if (!is_distortion) other.set_normals(bytes(std::vector<float>{0, 0, 1}));
      FrameAssembly assembly(2);
      ASSERT_TRUE(assembly.add(parts[0]).ok());
      const auto refused = assembly.add(parts[1]);
      EXPECT_EQ(fault_of(refused.status()).reason, "FRAME_PARTS");
    }
  }
}

TEST(FrameAssembly, ReadsACertificateWhereThereIsOne) {
  FrameAssembly assembly(1);
  v1::FramePart whole = first_part(1, {1, 2, 3}, true);
  EXPECT_EQ(assembly.add(whole).value()->optimality_gap, std::nullopt);
  whole.mutable_header()->mutable_certificate();
  EXPECT_EQ(assembly.add(whole).value()->optimality_gap, 0);  // a gap of 0 is one
}

TEST(FrameAssembly, ReadsDoublesBitForBit) {
  v1::FramePart whole = first_part(1, {0, 0, 0}, true);
  whole.mutable_header()->set_scalar(v1::SCALAR_FLOAT64);
  whole.set_positions(bytes(std::vector<double>{0.1, 1e300, -3}));
  whole.set_distortion(bytes(std::vector<double>{0.3}));
  FrameAssembly assembly(1);
  const auto frame = assembly.add(whole);
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->positions, (std::vector<double>{0.1, 1e300, -3}));
  EXPECT_EQ((*frame)->distortion, std::vector<double>{0.3});
  EXPECT_TRUE((*frame)->normals.empty());
}

TEST(FrameAssembly, RefusesPartsThatDoNotFit) {
  const auto reason_of = [](FrameAssembly assembly, std::vector<v1::FramePart> parts) {
    absl::Status status;
    for (const v1::FramePart& part : parts) status.Update(assembly.add(part).status());
    return fault_of(status).reason;
  };
  const std::vector<float> one = {1, 2, 3};
  EXPECT_EQ(reason_of(FrameAssembly(2), {part(0, one, false)}), "FRAME_PARTS") << "no header";
  EXPECT_EQ(reason_of(FrameAssembly(9), {first_part(2, one, false)}), "FRAME_PARTS") << "another mesh";
  EXPECT_EQ(reason_of(FrameAssembly(3), {first_part(3, one, false), part(2, one, true)}), "FRAME_PARTS")
      << "a gap";
  EXPECT_EQ(reason_of(FrameAssembly(2), {first_part(2, one, true)}), "FRAME_PARTS") << "ends early";
  EXPECT_EQ(reason_of(FrameAssembly(1), {first_part(1, one, false), part(1, one, true)}), "FRAME_PARTS")
      << "too many";
  v1::FramePart short_one = first_part(1, one, true);
  short_one.set_positions("abc");
  EXPECT_EQ(reason_of(FrameAssembly(1), {short_one}), "FRAME_PARTS") << "too few bytes";
}

/// Two vertices, quantized: 0 and 65535 of everything.
v1::FramePart quantized_part() {
  v1::FramePart whole = first_part(2, {0, 0, 0, 0, 0, 0}, true);
  whole.clear_distortion();
  whole.mutable_header()->set_encoding(v1::ENCODING_QUANTIZED);
  v1::Quantization& quantization = *whole.mutable_header()->mutable_quantization();
  quantization.mutable_origin()->set_x(-1);
  quantization.mutable_extent()->set_x(3);
  quantization.mutable_extent()->set_z(0.5);
  quantization.set_distortion_extent(8);
  whole.set_positions(bytes(std::vector<std::uint16_t>{0, 0, 0, 0, 65535, 65535, 65535, 65535}));
  whole.set_normals(bytes(std::vector<std::int16_t>{0, 0, 32767, 0, -32767, 0, 0, 0}));
  return whole;
}

TEST(FrameAssembly, ReadsQuantizedNumbers) {
  FrameAssembly assembly(2);
  const auto frame = assembly.add(quantized_part());
  ASSERT_TRUE(frame.ok() && frame->has_value());
  EXPECT_EQ((*frame)->positions, (std::vector<double>{-1, 0, 0, 2, 0, 0.5}));
  EXPECT_EQ((*frame)->distortion, (std::vector<double>{0, 8}));
  EXPECT_EQ((*frame)->normals, (std::vector<double>{0, 0, 1, -1, 0, 0}));
}

TEST(FrameAssembly, RefusesQuantizedPartsThatAreTooShortOrNotCompressed) {
  FrameAssembly assembly(2);
  v1::FramePart part = quantized_part();
  part.mutable_positions()->pop_back();
  EXPECT_EQ(fault_of(assembly.add(part).status()).reason, "FRAME_PARTS");
  part = quantized_part();
  part.mutable_normals()->pop_back();
  EXPECT_EQ(fault_of(assembly.add(part).status()).reason, "FRAME_PARTS");
  part = quantized_part();
  part.mutable_header()->set_encoding(v1::ENCODING_COMPRESSED);
  EXPECT_EQ(fault_of(assembly.add(part).status()).reason, "FRAME_PARTS");
  part.mutable_header()->set_encoding(static_cast<v1::Encoding>(9));
  EXPECT_EQ(fault_of(assembly.add(part).status()).reason, "FRAME_PARTS");
}

}  // namespace
}  // namespace lpdeform::client
