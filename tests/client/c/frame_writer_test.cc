// Frames into vertex buffers of engines.

#include "client/c/frame_writer.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <vector>

#include "core/base/colour.h"
#include "core/base/fault.h"

namespace lpdeform::engine {
namespace {

using testing::Each;
using testing::ElementsAre;

client::Frame two_vertices() {
  client::Frame frame;
  frame.positions = {1, 2, 3, 5, 2, -1};
  frame.normals = {0, 0.6, -0.8, 1, 0, 0};
  frame.distortion = {0, 4};
  frame.energy = 4;
  frame.is_final = true;
  return frame;
}

Space unreal() {
  lpdeform_options options{};
  options.handedness = LPDEFORM_LEFT_HANDED;
  options.up = LPDEFORM_Z_UP;
  options.units_per_metre = 100;
  return Space::of(options).value();
}

template <typename T>
lpdeform_target target_of(std::vector<T>& buffer, lpdeform_format format, std::uint32_t offset = 0,
                          std::uint32_t stride = 0) {
  return {buffer.data(), buffer.size() * sizeof(T), offset, stride, format, 0};
}

lpdeform_buffers no_buffers() {
  lpdeform_buffers buffers{};
  buffers.struct_size = sizeof buffers;
  return buffers;
}

TEST(FrameWriter, PositionsComeInTheEnginesCoordinates) {
  std::vector<float> at(6);
  lpdeform_buffers buffers = no_buffers();
  buffers.positions = target_of(at, LPDEFORM_FLOAT32);
  const lpdeform_frame said = write_frame(two_vertices(), unreal(), buffers);
  EXPECT_THAT(at, ElementsAre(100, 300, 200, 500, -100, 200));
  EXPECT_EQ(said.vertex_count, 2);
  EXPECT_EQ(said.is_final, 1);
  EXPECT_EQ(said.energy, 4);
}

TEST(FrameWriter, BytesBetweenVerticesAreLeftAlone) {
  std::vector<unsigned char> buffer(1 + 2 * 27, 0xAB);
  lpdeform_buffers buffers = no_buffers();
  buffers.positions = target_of(buffer, LPDEFORM_FLOAT32, 3, 27);  // unaligned on purpose
  write_frame(two_vertices(), Space(), buffers);
  float x = 0;
  std::memcpy(&x, buffer.data() + 3 + 27, sizeof x);
  EXPECT_EQ(x, 5);
  for (std::size_t k = 0; k < buffer.size(); ++k) {
    const bool is_vertex = (k >= 3 && k < 15) || (k >= 30 && k < 42);
    EXPECT_TRUE(is_vertex || buffer[k] == 0xAB) << "byte " << k;
  }
}

TEST(FrameWriter, NormalisedPositionsAreExactToHalfAStep) {
  std::vector<std::uint16_t> at(8);
  lpdeform_buffers buffers = no_buffers();
  buffers.positions = target_of(at, LPDEFORM_UNORM16);
  const client::Frame frame = two_vertices();
  const lpdeform_frame said = write_frame(frame, Space(), buffers);
  EXPECT_THAT(said.origin, ElementsAre(1, 2, -1));
  EXPECT_THAT(said.extent, ElementsAre(4, 0, 4));
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      const double back = said.origin[k] + at[4 * i + k] / 65535.0 * said.extent[k];
      EXPECT_NEAR(back, frame.positions[3 * i + k], said.extent[k] / 131070 + 1e-12);
    }
    EXPECT_EQ(at[4 * i + 3], 65535);
  }
}

TEST(FrameWriter, NormalsAreTurnedAndNotScaled) {
  std::vector<float> normals(6);
  std::vector<std::int16_t> wide(8);
  std::vector<std::int8_t> narrow(8);
  lpdeform_buffers buffers = no_buffers();
  buffers.normals = target_of(normals, LPDEFORM_FLOAT32);
  write_frame(two_vertices(), unreal(), buffers);
  EXPECT_THAT(normals, ElementsAre(0, -0.8F, 0.6F, 1, 0, 0));
  buffers.normals = target_of(wide, LPDEFORM_SNORM16);
  write_frame(two_vertices(), unreal(), buffers);
  EXPECT_THAT(wide, ElementsAre(0, -26214, 19660, 0, 32767, 0, 0, 0));
  buffers.normals = target_of(narrow, LPDEFORM_SNORM8);
  write_frame(two_vertices(), unreal(), buffers);
  EXPECT_THAT(narrow, ElementsAre(0, -102, 76, 0, 127, 0, 0, 0));
}

TEST(FrameWriter, ColoursAreThoseOfPictures) {
  std::vector<std::uint8_t> rgba(8), bgra(8);
  std::vector<float> floats(8);
  lpdeform_buffers buffers = no_buffers();
  buffers.colours = target_of(rgba, LPDEFORM_RGBA8);
  EXPECT_EQ(write_frame(two_vertices(), Space(), buffers).red_distortion, 4);
  const Rgb blue = blue_to_red(0), red = blue_to_red(1);
  EXPECT_THAT(rgba, ElementsAre(blue[0], blue[1], blue[2], 255, red[0], red[1], red[2], 255));
  buffers.colours = target_of(bgra, LPDEFORM_BGRA8);
  write_frame(two_vertices(), Space(), buffers);
  EXPECT_THAT(bgra, ElementsAre(blue[2], blue[1], blue[0], 255, red[2], red[1], red[0], 255));
  buffers.colours = target_of(floats, LPDEFORM_FLOAT32);
  buffers.red_distortion = 8;
  write_frame(two_vertices(), Space(), buffers);
  const Rgb middle = blue_to_red(0.5);
  EXPECT_NEAR(floats[4], middle[0] / 255.0, 1.0 / 255);  // one of 1024 shades beside
  EXPECT_EQ(floats[7], 1);
}

TEST(FrameWriter, DistortionIsAsItCame) {
  std::vector<double> distortion(2);
  lpdeform_buffers buffers = no_buffers();
  buffers.distortion = target_of(distortion, LPDEFORM_FLOAT64);
  write_frame(two_vertices(), unreal(), buffers);
  EXPECT_THAT(distortion, ElementsAre(0, 4));
}

std::string refused(const lpdeform_buffers& buffers, const FrameContents& contents = {.normals = true}) {
  return fault_of(check_buffers(buffers, 2, contents)).reason;
}

TEST(FrameWriter, BuffersThatDoNotFitAreRefused) {
  std::vector<float> at(6, 7);
  lpdeform_buffers buffers = no_buffers();
  buffers.positions = target_of(at, LPDEFORM_FLOAT32);
  EXPECT_EQ(refused(buffers), "");
  buffers.positions.offset = 4;
  EXPECT_EQ(refused(buffers), "BUFFER_TOO_SMALL");
  buffers.positions = target_of(at, LPDEFORM_FLOAT64);
  EXPECT_EQ(refused(buffers), "BUFFER_TOO_SMALL");
  buffers.positions = target_of(at, LPDEFORM_RGBA8);
  EXPECT_EQ(refused(buffers), "FORMAT_UNKNOWN");
  buffers.positions = target_of(at, LPDEFORM_FLOAT32, 0, 8);
  EXPECT_EQ(refused(buffers), "STRIDE_TOO_SMALL");
  buffers = no_buffers();
  buffers.normals = target_of(at, LPDEFORM_FLOAT32);
  EXPECT_EQ(refused(buffers, {.normals = false}), "NO_NORMALS");
  buffers = no_buffers();
  buffers.colours = target_of(at, LPDEFORM_RGBA8);
  EXPECT_EQ(refused(buffers, {.distortion = false}), "NO_DISTORTION");
  buffers.red_distortion = std::nan("");
  EXPECT_EQ(refused(buffers), "RED_OUT_OF_RANGE");
}

}  // namespace
}  // namespace lpdeform::engine
