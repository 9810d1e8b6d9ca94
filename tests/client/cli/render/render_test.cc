#include "client/cli/render/render.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <numbers>

#include "client/cli/render/shading.h"
#include "core/base/fault.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

constexpr int kWidth = 160, kHeight = 120;

Rgb pixel(const Image& image, int x, int y) {
  const std::uint8_t* bytes = &image.bytes[3 * (std::size_t(y) * image.width + x)];
  return {bytes[0], bytes[1], bytes[2]};
}

bool is_background(const Image& image, int x, int y) {
  return pixel(image, x, y) == background((y + 0.5) / image.height);
}

/// How many pixels of the image satisfy `holds(x, y)`.
template <typename Holds>
int count_pixels(const Image& image, const Holds& holds) {
  int count = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) count += holds(x, y) ? 1 : 0;
  }
  return count;
}

Image plain(const TriangleMesh& mesh) {
  return render(mesh.faces, mesh.vertices, {}, kWidth, kHeight);
}

double brightness(const Image& image, int x, int y) {
  const Rgb colour = pixel(image, x, y);
  return colour[0] + colour[1] + colour[2];
}

TEST(Render, ASphereFillsADiscInsideTheMargins) {
  const Image image = plain(sphere(4));
  const int covered = count_pixels(image, [&](int x, int y) { return !is_background(image, x, y); });
  const double radius = 0.8 * kHeight / 2;  // margins of 8 % above and 12 % below
  EXPECT_NEAR(covered, std::numbers::pi * radius * radius, 0.06 * covered);
  EXPECT_EQ(
      count_pixels(image, [&](int x, int y) { return y < 0.07 * kHeight && !is_background(image, x, y); }),
      0);
}

TEST(Render, TheLightComesFromTheUpperLeft) {
  const Image image = plain(sphere(4));
  const int x = kWidth / 2, y = static_cast<int>(0.48 * kHeight), step = kHeight / 5;
  EXPECT_GT(brightness(image, x - step, y - step), brightness(image, x, y));
  EXPECT_GT(brightness(image, x - step, y), brightness(image, x + step, y));
  EXPECT_GT(brightness(image, x, y - step), brightness(image, x, y + step));
  EXPECT_GT(brightness(image, x - step, y - step), 1.4 * brightness(image, x + step, y + step));
}

PictureStyle small_picture() {
  PictureStyle style;
  style.width = kWidth;
  style.height = kHeight;
  return style;
}

TEST(Render, AnEmptyStyleIsThePlainPicture) {
  const TriangleMesh mesh = sphere(3);
  EXPECT_EQ(render(mesh.faces, mesh.vertices, small_picture()).bytes, plain(mesh).bytes);
}

TEST(Render, VerticesHaveTheColoursTheyAreGiven) {
  const TriangleMesh mesh = sphere(4);
  PictureStyle style = small_picture();
  style.colours.assign(mesh.vertices.rows(), {20, 200, 20});
  const Image image = render(mesh.faces, mesh.vertices, style);
  const Rgb middle = pixel(image, kWidth / 2, static_cast<int>(0.48 * kHeight));
  EXPECT_GT(middle[1], 3 * middle[0]);
  EXPECT_GT(middle[1], 3 * middle[2]);
}

TEST(Render, AFrameKeepsTheCameraWhereTheMeshIsMoved) {
  const TriangleMesh mesh = sphere(3);
  const Points small = 0.5 * mesh.vertices;
  PictureStyle style = small_picture();
  const auto covered = [&] {
    const Image image = render(mesh.faces, small, style);
    return count_pixels(image, [&](int x, int y) { return !is_background(image, x, y); });
  };
  const int alone = covered();
  style.frame = mesh.vertices;
  EXPECT_NEAR(covered(), 0.25 * alone, 0.04 * alone);  // half as wide; perspective aside
}

TEST(Render, ALargerRedTurnsThePictureBluer) {
  const TriangleMesh mesh = sphere(3);
  PictureStyle style = small_picture();
  style.distortion = Field::Ones(mesh.vertices.rows());
  const auto middle = [&] {
    return pixel(render(mesh.faces, mesh.vertices, style), kWidth / 2, static_cast<int>(0.48 * kHeight));
  };
  EXPECT_GT(middle()[0], middle()[2]);
  style.red = 100;
  EXPECT_GT(middle()[2], middle()[0]);
}

TEST(Render, DistortionTurnsBlueIntoRed) {
  const TriangleMesh mesh = sphere(4);
  Field distortion = Field::Zero(mesh.vertices.rows());
  for (Eigen::Index v = 0; v < distortion.size(); ++v) distortion[v] = mesh.vertices(v, 1) > 0 ? 1 : 0;
  const Image image = render(mesh.faces, mesh.vertices, distortion, kWidth, kHeight);
  const auto is_dominant = [&](int channel, int x, int y) {
    const Rgb colour = pixel(image, x, y);
    return colour[channel] > 100 &&
           colour[channel] > 1.8 * std::max(colour[(channel + 1) % 3], colour[(channel + 2) % 3]);
  };
  // An icosphere extends equally along all axes; the camera then looks along x with z up, so y splits the
  // picture.
  const int red = count_pixels(image, [&](int x, int y) { return is_dominant(0, x, y); });
  const int blue = count_pixels(image, [&](int x, int y) { return is_dominant(2, x, y); });
  EXPECT_GT(red, 1000);
  EXPECT_GT(blue, 1000);
}

TEST(Render, TheLegendRunsFromBlueToRedOnlyWhereThereIsADistortion) {
  const TriangleMesh mesh = sphere(2);
  const Field distortion = Field::Constant(mesh.vertices.rows(), 0.25);
  const Image image = render(mesh.faces, mesh.vertices, distortion, kWidth, kHeight);
  const Image without = plain(mesh);
  int first_x = kWidth, last_x = 0, y_of_bar = 0;
  for (int y = kHeight * 3 / 4; y < kHeight; ++y) {
    for (int x = kWidth * 3 / 4; x < kWidth; ++x) {
      EXPECT_TRUE(is_background(without, x, y));
      const Rgb colour = pixel(image, x, y);
      if (std::max({colour[0], colour[1], colour[2]}) - std::min({colour[0], colour[1], colour[2]}) < 100)
        continue;
      first_x = std::min(first_x, x), last_x = std::max(last_x, x), y_of_bar = y;
    }
  }
  ASSERT_GT(last_x - first_x, kWidth / 6);
  EXPECT_GT(pixel(image, first_x, y_of_bar)[2], 180);
  EXPECT_GT(pixel(image, last_x, y_of_bar)[0], 180);
  const int ink =
      count_pixels(image, [&](int x, int y) { return y > y_of_bar && brightness(image, x, y) < 300; });
  EXPECT_GT(ink, 40) << "the dots of 0 and 0.25";
}

TEST(Render, BothSidesOfASurfaceLookTheSame) {
  TriangleMesh mesh = creature(24);
  const Image image = plain(mesh);
  mesh.faces.col(1).swap(mesh.faces.col(2));
  const Image turned = plain(mesh);
  const int different = count_pixels(
      image, [&](int x, int y) { return std::abs(brightness(image, x, y) - brightness(turned, x, y)) > 6; });
  EXPECT_LT(different, kWidth * kHeight / 200) << "but for rounding at the edges of faces";
}

TEST(Render, DoesNotDependOnTheUnitOfLength) {
  const TriangleMesh mesh = box_surface(2, 3, 4);
  const Image image = plain(mesh);
  // Powers of two, so that not even rounding differs.
  for (const double unit : {std::exp2(-700), std::exp2(40), std::exp2(700)}) {
    EXPECT_EQ(plain({unit * mesh.vertices, mesh.faces}).bytes, image.bytes);
  }
}

TEST(Render, LeavesOutFacesThatCannotBeDrawn) {
  const TriangleMesh mesh = box_surface(2, 3, 4);
  TriangleMesh bad = mesh;
  const Eigen::Index faces = mesh.faces.rows(), vertices = mesh.vertices.rows();
  bad.vertices.conservativeResize(vertices + 1, 3);
  bad.vertices.row(vertices) << 1, std::numeric_limits<double>::quiet_NaN(), 1;
  bad.faces.conservativeResize(faces + 3, 3);
  bad.faces.row(faces) << 0, 1, static_cast<std::int32_t>(vertices);
  bad.faces.row(faces + 1) << 0, 1, -1;
  bad.faces.row(faces + 2) << 0, 1, static_cast<std::int32_t>(vertices) + 1;
  EXPECT_EQ(plain(bad).bytes, plain(mesh).bytes);
}

TEST(Render, NothingToDrawIsBackground) {
  TriangleMesh point{Points::Ones(3, 3), Faces::Zero(1, 3)};
  for (const TriangleMesh& mesh : {TriangleMesh{}, point}) {
    const Image image = plain(mesh);
    EXPECT_EQ(count_pixels(image, [&](int x, int y) { return is_background(image, x, y); }),
              kWidth * kHeight);
  }
}

class RenderFile : public ::testing::Test {
 protected:
  RenderFile() {
    std::string name = (std::filesystem::temp_directory_path() / "lpdeform-render-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~RenderFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
  TriangleMesh mesh_ = sphere(1);
};

TEST_F(RenderFile, HoldsThePictureAsPng) {
  const std::filesystem::path path = folder_ / "x.png";
  ASSERT_TRUE(render_png(path, mesh_.faces, mesh_.vertices, {}, 90, 70).ok());
  png_image head{};
  head.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&head, path.c_str()), 0);
  EXPECT_EQ(head.width, 90u);
  EXPECT_EQ(head.height, 70u);
  head.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> bytes(PNG_IMAGE_SIZE(head));
  ASSERT_NE(png_image_finish_read(&head, nullptr, bytes.data(), 0, nullptr), 0);
  EXPECT_EQ(bytes, render(mesh_.faces, mesh_.vertices, {}, 90, 70).bytes);
}

TEST_F(RenderFile, RefusesSizesOutOfRange) {
  for (const auto& [width, height] : {std::pair{0, 10}, {10, -1}, {16385, 10}, {10, 16385}}) {
    const absl::Status status = render_png(folder_ / "x.png", mesh_.faces, mesh_.vertices, {}, width, height);
    EXPECT_EQ(fault_of(status).reason, "IMAGE_SIZE");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(RenderFile, NamesAPathThatCannotBeWritten) {
  const absl::Status status = render_png(folder_ / "no/x.png", mesh_.faces, mesh_.vertices, {}, 20, 20);
  EXPECT_EQ(fault_of(status).reason, "FILE_NOT_WRITTEN");
}

}  // namespace
}  // namespace lpdeform
