#include "core/gltf/alone.h"

#include <gmock/gmock.h>

#include <random>

#include "core/gltf/gltf.h"
#include "tests/core/gltf/made_gltf.h"

namespace lpdeform::gltf {
namespace {

using testing::Each;
using testing::ElementsAre;

/// `count` times three floats, without gaps.
Layout packed(std::uint64_t begin, std::uint64_t count) {
  return {0, begin, 12, 12, count};
}

/// How often two layouts were compared.
std::size_t questions(const std::vector<Layout>& layouts) {
  std::size_t asked = 0;
  alone(layouts, [&](const Layout& a, const Layout& b) {
    ++asked;
    return share_bytes(a, b);
  });
  return asked;
}

TEST(Alone, AreThoseThatShareNoByte) {
  EXPECT_THAT(alone({packed(24, 1), packed(0, 2), packed(35, 1)}, share_bytes),
              ElementsAre(false, true, false));
  const Layout position{0, 0, 20, 12, 6}, texture{0, 12, 20, 8, 6}, wide{0, 8, 20, 8, 6};
  EXPECT_THAT(alone({position, texture}, share_bytes), Each(true));
  EXPECT_THAT(alone({position, texture, wide}, share_bytes), Each(false));
}

TEST(Alone, AreTheSameAsByComparingAllPairs) {
  std::mt19937 random(7);
  const auto below = [&](std::uint64_t most) { return random() % most; };
  for (int round = 0; round < 500; ++round) {
    std::vector<Layout> layouts;
    for (std::size_t k = 0; k < kMostBetween; ++k) {
      const std::uint64_t size = 4 + 4 * below(3), stride = below(2) == 0 ? size : 20;
      layouts.push_back({0, 4 * below(400), stride, size, below(8)});
    }
    std::vector<bool> expected;
    for (std::size_t k = 0; k < layouts.size(); ++k) {
      bool shares = false;
      for (std::size_t other = 0; other < layouts.size(); ++other)
        shares = shares || (other != k && share_bytes(layouts[k], layouts[other]));
      expected.push_back(!shares);
    }
    EXPECT_EQ(alone(layouts, share_bytes), expected);
  }
}

TEST(Alone, AreFoundWithAFewComparisonsOfEach) {
  constexpr std::size_t kCount = 20'000;
  std::vector<Layout> rows, same(kCount, packed(0, 5)), nested;
  for (std::uint64_t k = 0; k < kCount; ++k) {
    rows.push_back(packed(60 * k, 5));
    nested.push_back(packed(12 * k, 2 * kCount - 2 * k));
  }
  EXPECT_EQ(questions(rows), 0U);
  for (const auto& layouts : {same, nested}) {
    EXPECT_LE(questions(layouts), kMostBetween * kCount);
    EXPECT_THAT(alone(layouts, share_bytes), Each(false));
  }
}

/// With more than kMostBetween others in its reach, a layout is taken for one that shares bytes, though it does not.
TEST(Alone, NoneIsWhereTooManyLieBetween) {
  std::vector<Layout> layouts{{0, 0, 16, 12, 1000}};
  for (std::uint64_t k = 0; k <= kMostBetween; ++k) layouts.push_back({0, 16 * k + 12, 16, 4, 1});
  EXPECT_THAT(alone(layouts, share_bytes), Each(false));
  layouts.pop_back();
  EXPECT_THAT(alone(layouts, share_bytes), Each(true));
}

/// 50,000 triangles with accessors of their own, in one view: comparing all pairs of primitives or of accessors would take most of an hour.
TEST(Alone, AFileOfVeryManyPrimitivesIsReadAndWrittenInPlace) {
  constexpr int kCount = 50'000;
  MadeGltf made;
  std::vector<float> corners;
  for (int k = 0; k < kCount; ++k) {
    const auto x = static_cast<float>(k);
    corners.insert(corners.end(), {x, 0, 0, x + 1, 0, 0, x, 1, 0});
  }
  const int view = made.view(corners);
  nlohmann::ordered_json primitives;
  for (int k = 0; k < kCount; ++k)
    primitives.push_back({{"attributes", {{"POSITION", made.accessor(view, "VEC3", 5126, 3, 36 * k)}}}});
  made.mesh(std::move(primitives));
  made.node({{"mesh", 0}});
  const auto file = Gltf::parse(made.glb(), {});
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->parts().size(), std::size_t{kCount});
  Points positions = file->mesh().vertices;
  positions.col(2).array() += 1;
  const auto bytes = file->bytes(positions, Packing::kGlb, std::nullopt);
  ASSERT_TRUE(bytes.ok()) << bytes.status();
  const auto again = Gltf::parse(*bytes, {});
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(again->mesh().vertices, positions);
  EXPECT_EQ(parse_container(*bytes).binary->size(), made.buffer.size()) << "nothing was appended";
}

}  // namespace
}  // namespace lpdeform::gltf
