// What the C interface shows of a mesh, against a real server: in every encoding and convention, and of split vertices.

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

TEST_F(CSessionTest, EveryEncodingShowsTheSame) {
  std::map<lpdeform_encoding, std::vector<Point>> seen;
  for (const auto encoding :
       {LPDEFORM_ENCODING_RAW, LPDEFORM_ENCODING_QUANTIZED, LPDEFORM_ENCODING_COMPRESSED}) {
    options_.encoding = encoding;
    open(strip_.mesh());
    hold("base", {0, 1});
    hold("tip", {20, 21}, shift(-1, 2, 0));
    seen[encoding] = settle(22);
    lpdeform_close(session_);
    session_ = nullptr;
  }
  EXPECT_EQ(seen[LPDEFORM_ENCODING_QUANTIZED], seen[LPDEFORM_ENCODING_COMPRESSED]);
  for (std::size_t i = 0; i < 22; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      // Half of 1/65535 of an extent of at most 10, the same again of two solves, and float32.
      EXPECT_NEAR(seen[LPDEFORM_ENCODING_RAW][i][k], seen[LPDEFORM_ENCODING_QUANTIZED][i][k], 2e-4);
    }
  }
}

/// How an engine says a point of the server's.
struct Convention {
  lpdeform_handedness handedness;
  lpdeform_up up;
  double units;
  Point (*of)(Point server);
};

TEST_F(CSessionTest, AnEnginesCoordinatesGiveTheSameShape) {
  const Convention conventions[] = {
      {LPDEFORM_RIGHT_HANDED, LPDEFORM_Y_UP, 1, [](Point p) { return p; }},
      {LPDEFORM_LEFT_HANDED, LPDEFORM_Y_UP, 1,
       [](Point p) {
         return Point{-p[0], p[1], p[2]};
       }},
      {LPDEFORM_LEFT_HANDED, LPDEFORM_Z_UP, 100,
       [](Point p) {
         return Point{100 * p[0], 100 * p[2], 100 * p[1]};
       }},
      {LPDEFORM_RIGHT_HANDED, LPDEFORM_Z_UP, 1,
       [](Point p) {
         return Point{p[0], -p[2], p[1]};
       }},
  };
  options_.with_normals = 1;
  std::vector<Point> wanted, wanted_normals;
  for (const Convention& convention : conventions) {
    options_.handedness = convention.handedness;
    options_.up = convention.up;
    options_.units_per_metre = convention.units;
    Strip strip;
    for (Point& point : strip.points) point = convention.of(point);
    if (convention.handedness == LPDEFORM_LEFT_HANDED &&
        convention.up == LPDEFORM_Y_UP) {  // as Unity winds them
      for (std::size_t k = 0; k < strip.indices.size(); k += 3)
        std::swap(strip.indices[k], strip.indices[k + 1]);
    }
    open(strip.mesh());
    hold("base", {0, 1});
    // A quarter turn about the server's z that takes x to y: mirrored engines turn the other way round.
    const Point to = convention.of({-3, 5, 0});
    lpdeform_motion motion = shift(to[0], to[1], to[2]);
    const Point axis = convention.of({0, 0, 1}), center = convention.of({10, 0, 0.5});
    const double mirror = convention.handedness == LPDEFORM_LEFT_HANDED ? -1 : 1;
    for (int k = 0; k < 3; ++k) {
      motion.center[k] = center[k];
      motion.rotation[k] = mirror * std::sqrt(0.5) * axis[k] / convention.units;
    }
    motion.rotation[3] = std::sqrt(0.5);
    hold("tip", {20, 21, 18, 19}, motion);

    std::vector<Point> points(22), normals(22);
    lpdeform_buffers buffers = buffers_of(points);
    buffers.normals = {normals.data(), normals.size() * sizeof(Point), 0, 0, LPDEFORM_FLOAT32, 0};
    ASSERT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, &frame_, &error_), LPDEFORM_OK)
        << error_.message;
    lpdeform_close(session_);
    session_ = nullptr;
    if (wanted.empty()) {
      wanted = points;
      wanted_normals = normals;
      EXPECT_NEAR(points[18][1] - points[20][1], -1, 1e-5);  // the tip stands upright
      EXPECT_NEAR(normals[0][1], 1, 0.5);                    // and the base looks up
    }
    for (std::size_t i = 0; i < 22; ++i) {
      const Point there = convention.of(wanted[i]), turned = convention.of(wanted_normals[i]);
      for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(points[i][k], there[k], 1e-4 * 10 * convention.units)
            << "vertex " << i;  // the solve's tolerance
        EXPECT_NEAR(normals[i][k], turned[k] / convention.units, 1e-3) << "vertex " << i;
      }
    }
  }
}

TEST_F(CSessionTest, SplitVerticesComeBackInTheirOrderAndTogether) {
  // Every triangle has three vertices of its own.
  Strip whole = strip_, split;
  split.points.clear();
  split.indices.clear();
  for (const std::uint32_t index : whole.indices) {
    split.indices.push_back(static_cast<std::uint32_t>(split.points.size()));
    split.points.push_back(whole.points[index]);
  }
  lpdeform_mesh mesh = split.mesh();
  mesh.weld_by_position = 1;
  split.points[0][0] += 1e-5;  // within the tolerance below
  mesh.weld_tolerance = 1e-4;
  open(mesh);
  std::vector<std::uint32_t> base, tip;
  for (std::uint32_t i = 0; i < whole.indices.size(); ++i) {
    if (whole.indices[i] < 2) base.push_back(i);
    if (whole.indices[i] >= 20) tip.push_back(i);
  }
  hold("base", base);
  hold("tip", tip, shift(-2, 3, 0));
  const std::vector<Point> points = settle(split.points.size());
  std::map<std::uint32_t, std::set<Point>> places;
  for (std::size_t i = 0; i < points.size(); ++i) places[whole.indices[i]].insert(points[i]);
  for (const auto& [vertex, its] : places)
    EXPECT_EQ(its.size(), 1) << "copies of vertex " << vertex << " are apart";
  EXPECT_EQ(*places[20].begin(), (Point{8, 3, 1}));
}

TEST_F(CSessionTest, ANoticeSaysWhereAMeshIsSplit) {
  Strip split = strip_;
  for (std::uint32_t& index : split.indices) {
    if (index != 2) continue;
    split.points.push_back(split.points[2]);
    index = static_cast<std::uint32_t>(split.points.size() - 1);
  }
  lpdeform_mesh mesh = split.mesh();
  open(mesh);
  std::array<char, 512> text{};
  EXPECT_TRUE(eventually(
      [&] { return lpdeform_session_notice(session_, text.data(), text.size()) == LPDEFORM_NOTICE_MESH; }));
  EXPECT_THAT(text.data(), testing::HasSubstr("comes apart where it is split"));
  lpdeform_close(session_);
  session_ = nullptr;
  mesh.weld_by_position = 1;
  open(mesh);
  hold("base", {0, 1});
  settle(split.points.size());
  EXPECT_EQ(lpdeform_session_notice(session_, text.data(), text.size()), LPDEFORM_NOTICE_NONE);
}

}  // namespace
}  // namespace lpdeform::engine
