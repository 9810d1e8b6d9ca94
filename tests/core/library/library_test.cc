#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <lpdeform/core.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <numeric>
#include <stop_token>
#include <string>
#include <vector>

namespace lpdeform::core {
namespace {

constexpr std::uint32_t kSide = 12;    // vertices along each side of the sheet
constexpr std::uint32_t kAround = 24;  // vertices around the dumbbell

std::uint32_t at(std::uint32_t x, std::uint32_t y) {
  return y * kSide + x;
}

/// A square sheet with vertices at whole numbers, in the plane z = 0.
Mesh sheet() {
  Mesh mesh;
  for (std::uint32_t y = 0; y < kSide; ++y) {
    for (std::uint32_t x = 0; x < kSide; ++x) {
      mesh.vertices.insert(mesh.vertices.end(), {double(x), double(y), 0.0});
      if (x + 1 == kSide || y + 1 == kSide) continue;
      for (const std::uint32_t v :
           {at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y), at(x + 1, y + 1), at(x, y + 1)})
        mesh.faces.push_back(v);
    }
  }
  return mesh;
}

/// Two balls with a thin neck between them: a surface of revolution about z.
Mesh dumbbell() {
  constexpr std::uint32_t kAlong = 61;
  Mesh mesh;
  for (std::uint32_t k = 0; k < kAlong; ++k) {
    const double z = -3.0 + 6.0 * k / (kAlong - 1), from_ball = std::abs(z) - 1.9;
    const double ball = 1.21 - from_ball * from_ball;
    const double radius = std::max(0.25, ball > 0 ? std::sqrt(ball) : 0.0);
    for (std::uint32_t a = 0; a < kAround; ++a) {
      const double angle = 2 * 3.14159265358979 * a / kAround;
      mesh.vertices.insert(mesh.vertices.end(), {radius * std::cos(angle), radius * std::sin(angle), z});
      if (k + 1 == kAlong) continue;
      const std::uint32_t here = k * kAround + a, next = k * kAround + (a + 1) % kAround;
      for (const std::uint32_t v : {here, next, next + kAround, here, next + kAround, here + kAround})
        mesh.faces.push_back(v);
    }
  }
  return mesh;
}

Handle column(std::uint32_t x, Motion motion = Fixed{}) {
  Handle handle{.motion = std::move(motion)};
  for (std::uint32_t y = 0; y < kSide; ++y) handle.vertices.push_back(at(x, y));
  return handle;
}

Handles folded() {
  return {{"left", column(0)},
          {"right",
           column(kSide - 1, RigidMotion{.axis = {0, 1, 0}, .angle_radians = -1, .translation = {0, 0, 2}})}};
}

TEST(CoreLibrary, PutsHandlesWhereTheyShouldBeAndAddsUpTheEnergy) {
  for (const double p : {1.5, 2.0, 6.0}) {
    const auto result = deform(sheet(), folded(), {.p = p, .length_unit = 1.0});
    ASSERT_TRUE(result) << result.error().text;
    EXPECT_EQ(result->stop_reason, StopReason::kConverged);
    ASSERT_EQ(result->positions.size(), sheet().vertices.size());
    for (std::uint32_t y = 0; y < kSide; ++y) {
      const double* const right = &result->positions[3 * at(kSide - 1, y)];
      EXPECT_NEAR(right[0], (kSide - 1) * std::cos(1.0), 1e-12);
      EXPECT_NEAR(right[1], y, 1e-12);
      EXPECT_NEAR(right[2], (kSide - 1) * std::sin(1.0) + 2, 1e-12);
      EXPECT_EQ(result->positions[3 * at(0, y)], 0);
    }
    const double energy = std::accumulate(result->distortion.begin(), result->distortion.end(), 0.0,
                                          [&](double sum, double e) { return sum + std::pow(e, p); });
    EXPECT_GT(energy, 0);
    EXPECT_NEAR(result->energy, energy, 1e-9 * energy);
  }
}

TEST(CoreLibrary, ASessionGoesOnFromItsShapeAndReachesWhatACallReaches) {
  auto session = Session::open(sheet());
  ASSERT_TRUE(session);
  ASSERT_TRUE(session->set_handles({{"left", column(0)}, {"right", column(kSide - 1)}}));
  ASSERT_TRUE(session->set({.p = 2.0}));
  const auto rest = session->solve();
  ASSERT_TRUE(rest);
  // Rounding of numbers up to 11.
  EXPECT_THAT(rest->positions, testing::Pointwise(testing::DoubleNear(1e-13), sheet().vertices));
  EXPECT_EQ(rest->energy, 0);
  ASSERT_TRUE(session->move("right", folded().at("right").motion));
  const auto moved = session->solve({.tolerance = 1e-12});
  const auto once = deform(sheet(), folded(), {.p = 2.0}, {.tolerance = 1e-12});
  ASSERT_TRUE(moved && once);
  EXPECT_NEAR(moved->energy, once->energy, 1e-6 * once->energy);
}

TEST(CoreLibrary, StepsReachWhatASolveReaches) {
  auto session = Session::open(sheet());
  ASSERT_TRUE(session && session->set_handles(folded()) && session->start());
  int steps = 1;
  double before = std::numeric_limits<double>::infinity();
  for (; session->step(); ++steps) {
    EXPECT_EQ(session->result().stop_reason, StopReason::kRunning);
    EXPECT_LE(session->result().energy, before);
    before = session->result().energy;
  }
  EXPECT_GT(steps, 3);
  const auto solved = deform(sheet(), folded());
  ASSERT_TRUE(solved);
  EXPECT_EQ(session->result().positions, solved->positions);
}

TEST(CoreLibrary, GivesTheSameBitsOnAnyNumberOfThreads) {
  const auto one = deform(sheet(), folded(), {.p = 1.5}, {}, {.threads = 1});
  const auto two = deform(sheet(), folded(), {.p = 1.5}, {}, {.threads = 2});
  ASSERT_TRUE(one && two);
  EXPECT_EQ(one->positions, two->positions);
}

TEST(CoreLibrary, AStopEndsASolveWithinAnIterationAndTheSessionGoesOn) {
  auto session = Session::open(sheet());
  ASSERT_TRUE(session && session->set_handles(folded()));
  std::stop_source stop;
  int calls = 0;
  const auto ended = session->solve({.stop = stop.get_token(), .on_progress = [&](const Progress&) {
                                       if (++calls == 3) stop.request_stop();
                                     }});
  ASSERT_TRUE(ended);
  EXPECT_EQ(ended->stop_reason, StopReason::kCancelled);
  EXPECT_LE(calls, 4);
  const auto whole = session->solve();
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->stop_reason, StopReason::kConverged);
  EXPECT_LT(whole->energy, ended->energy);
}

TEST(CoreLibrary, CertifiesAResult) {
  const auto result = deform(sheet(), folded(), {.p = 2.0}, {.tolerance = 1e-10, .certify = true});
  ASSERT_TRUE(result && result->optimality_gap);
  EXPECT_GE(*result->optimality_gap, 0);
  EXPECT_LT(*result->optimality_gap, 1e-3);
}

TEST(CoreLibrary, SaysWhatItHasSearched) {
  const auto first = deform(sheet(), folded(), {.p = 1.5}, {.effort = 0});
  ASSERT_TRUE(first);
  EXPECT_EQ(first->minima, std::vector{first->energy});
  EXPECT_EQ(first->further_starts, 0);
  EXPECT_EQ(first->search_iterations, 0);
  EXPECT_EQ(first->effort, 0);
  const auto result = deform(sheet(), folded(), {.p = 1.5});
  ASSERT_TRUE(result);
  EXPECT_EQ(result->effort, 1);
  EXPECT_EQ(result->further_starts, 12);
  EXPECT_GT(result->search_iterations, 0);
  EXPECT_LE(result->search_iterations, result->iterations - first->iterations);
  ASSERT_FALSE(result->minima.empty());
  EXPECT_EQ(result->minima.front(), first->energy);
  EXPECT_EQ(*std::ranges::min_element(result->minima), result->energy);
}

TEST(CoreLibrary, HoldsWhatIsOutsideTheRegion) {
  auto session = Session::open(sheet());
  std::vector<std::uint32_t> region;
  for (std::uint32_t v = 0; v < kSide * kSide; ++v) {
    if (v % kSide >= kSide / 2) region.push_back(v);
  }
  ASSERT_TRUE(session && session->set_handles(folded()) && session->set({.region = region}));
  const auto result = session->solve();
  ASSERT_TRUE(result);
  for (std::uint32_t v = 0; v < kSide * kSide; ++v) {
    if (v % kSide >= kSide / 2) continue;
    EXPECT_EQ(result->positions[3 * v + 2], 0) << v;
  }
  EXPECT_GT(result->positions[3 * at(kSide - 1, 0) + 2], 2);
}

TEST(CoreLibrary, TakesEveryKindOfHold) {
  for (const Hold& hold :
       {Hold(Soft{1e3}), Hold(Orientation{}), Hold(AxisLock{{0, 0, 1}}), Hold(PlaneLock{{1, 0, 0}})}) {
    Handles handles = folded();
    Handle middle = column(kSide / 2, RigidMotion{.translation = {0, 0, 1}});
    middle.hold = hold;
    handles.emplace("middle", middle);
    const auto result = deform(sheet(), handles, {.p = 2.0});
    ASSERT_TRUE(result) << hold.index() << result.error().text;
    EXPECT_GT(result->energy, 0);
  }
  Handles handles{{"left", column(0)}};
  handles["point"] = {.motion = TargetPositions{{10, 10, 3}}, .points = {{.face = 240}}};
  const auto result = deform(sheet(), handles);
  ASSERT_TRUE(result) << result.error().text;
  const Mesh mesh = sheet();
  double z = 0;
  for (int c = 0; c < 3; ++c) z += result->positions[3 * mesh.faces[3 * 240 + c] + 2] / 3;
  EXPECT_NEAR(z, 3, 1e-9);
}

/// What the error says; all empty if there is none.
template <typename T>
std::vector<std::string> said(const Result<T>& result) {
  if (result.ok()) return {};
  EXPECT_FALSE(result.error().text.empty());
  return {result.error().reason, result.error().element, result.error().limit};
}

using testing::ElementsAre;

TEST(CoreLibrary, RefusesMeshesThatAreNone) {
  Mesh mesh = sheet();
  mesh.vertices.pop_back();
  EXPECT_THAT(said(Session::open(mesh)), ElementsAre("MESH_SIZE", "vertices", "3 numbers each"));
  mesh = sheet();
  mesh.faces.pop_back();
  EXPECT_THAT(said(Session::open(mesh)), ElementsAre("MESH_SIZE", "faces", "3 numbers each"));
  for (const std::uint32_t wrong : {kSide * kSide, 4'294'967'295u}) {
    mesh = sheet();
    mesh.faces[7] = wrong;
    EXPECT_THAT(said(Session::open(mesh)),
                ElementsAre("MESH_INDEX_OUT_OF_RANGE", "face 2", "vertices < 144"));
  }
  EXPECT_EQ(said(Session::open(Mesh{})).at(0), "MESH_EMPTY");
  mesh = sheet();
  mesh.vertices[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(said(Session::open(mesh)).at(0), "MESH_NOT_FINITE");
  EXPECT_EQ(said(Session::open(sheet(), {.threads = -1})).at(0), "THREADS_OUT_OF_RANGE");
}

TEST(CoreLibrary, RefusesHandlesAndSettingsAndKeepsWhatThereWas) {
  auto session = Session::open(sheet());
  ASSERT_TRUE(session);
  EXPECT_EQ(said(session->solve()).at(0), "NO_HANDLES");
  ASSERT_TRUE(session->set_handles(folded()));
  EXPECT_THAT(said(session->set_handle("tip", {.vertices = {5, 144}})),
              ElementsAre("HANDLE_VERTEX_OUT_OF_RANGE", "vertex 144", "0 <= vertex < 144"));
  EXPECT_EQ(said(session->set_handle("tip", {.vertices = {0}})).at(0), "HANDLE_VERTEX_TWICE");
  EXPECT_EQ(said(session->set_handle("tip", {.points = {{.face = 4'000'000'000u}}})).at(0),
            "HANDLE_FACE_OUT_OF_RANGE");
  EXPECT_EQ(said(session->set_handle("tip", {.vertices = {5}, .motion = TargetPositions{{1, 2}}})).at(0),
            "HANDLE_TARGET_COUNT");
  EXPECT_EQ(said(session->move("none", Fixed{})).at(0), "HANDLE_UNKNOWN");
  EXPECT_THAT(said(session->set({.p = 0.5})), ElementsAre("P_OUT_OF_RANGE", testing::_, testing::_));
  EXPECT_EQ(said(session->set({.p = std::vector<double>(143, 2.0)})).at(0), "FIELD_SIZE");
  EXPECT_EQ(said(session->set({.region = std::vector<std::uint32_t>{144}})).at(0),
            "REGION_VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(said(session->set_positions({1, 2, 3})).at(0), "POSITIONS_SIZE");
  EXPECT_EQ(said(session->solve({.tolerance = 1})).at(0), "TOLERANCE_OUT_OF_RANGE");
  const auto after = session->solve();
  const auto plain = deform(sheet(), folded());
  ASSERT_TRUE(after && plain);
  EXPECT_EQ(after->positions, plain->positions);
}

TEST(CoreLibrary, AValueThatIsNotThereIsAFailureWithTheError) {
  try {
    (void)Session::open(Mesh{}).value();
    FAIL();
  } catch (const Failure& failure) {
    EXPECT_EQ(failure.error().reason, "MESH_EMPTY");
    EXPECT_EQ(failure.what(), failure.error().text);
  }
}

TEST(CoreLibrary, CountsVerticesWhereTheSurfaceSplitsOpen) {
  Mesh mesh{{0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0}, {0, 1, 2, 3, 5, 4}};
  const auto split = Session::open(mesh);
  ASSERT_TRUE(split);
  EXPECT_EQ(split->report().split_border_vertices, 4);
  EXPECT_EQ(split->report().components, 2);
  const auto whole = Session::open(sheet());
  ASSERT_TRUE(whole);
  EXPECT_EQ(whole->report().split_border_vertices, 0);
}

TEST(CoreLibrary, ASplitMeshDeformsAsOneWhenItIsWelded) {
  const Mesh whole = sheet();
  Mesh split;  // three vertices of its own for each face
  for (const std::uint32_t v : whole.faces) {
    split.faces.push_back(static_cast<std::uint32_t>(split.faces.size()));
    split.vertices.insert(split.vertices.end(), {whole.vertices[3 * v], whole.vertices[3 * v + 1], 0.0});
  }
  const auto welded = weld(split);
  ASSERT_TRUE(welded);
  EXPECT_EQ(welded->mesh.vertices.size(), whole.vertices.size());
  EXPECT_EQ(welded->vertex_of.size(), whole.faces.size());
  for (std::size_t k = 0; k < split.faces.size(); ++k) EXPECT_EQ(welded->mesh.faces[k], welded->vertex_of[k]);

  Handle left, right{.motion = RigidMotion{.translation = {0, 0, 3}}};
  for (std::uint32_t v = 0; v < kSide * kSide; ++v) {
    if (welded->mesh.vertices[3 * v] == 0) left.vertices.push_back(v);
    if (welded->mesh.vertices[3 * v] == kSide - 1) right.vertices.push_back(v);
  }
  const auto result = deform(welded->mesh, {{"left", left}, {"right", right}});
  ASSERT_TRUE(result);
  const std::vector<double> drawn = welded->spread(result->positions);
  ASSERT_EQ(drawn.size(), split.vertices.size());
  for (std::size_t k = 0; k < whole.faces.size(); ++k) {
    for (std::size_t d = 0; d < 3; ++d)
      EXPECT_EQ(drawn[3 * k + d], result->positions[3 * welded->vertex_of[k] + d]);
  }
  EXPECT_EQ(welded->spread(result->distortion).size(), whole.faces.size());
}

TEST(CoreLibrary, SaysWhyItCannotWeld) {
  EXPECT_EQ(weld(sheet(), 0.5).error().reason, "WELD_TOLERANCE");
  EXPECT_EQ(weld({{0, 0}, {}}).error().reason, "MESH_SIZE");
  const auto nothing = weld(Mesh{});
  ASSERT_TRUE(nothing);
  EXPECT_TRUE(nothing->spread({}).empty());
}

TEST(CoreLibrary, FindsPAndStiffnessFromTheGeometry) {
  auto session = Session::open(dumbbell());
  ASSERT_TRUE(session);
  const auto found = session->automatic();
  ASSERT_TRUE(found);
  const auto& p = std::get<std::vector<double>>(*found->p);
  const auto& stiffness = std::get<std::vector<double>>(*found->stiffness);
  const std::size_t neck = p.size() / 2, ball = 11 * kAround;
  EXPECT_GT(p[neck], p[ball] + 0.2);
  EXPECT_LT(stiffness[neck], stiffness[ball] / 2);
  EXPECT_TRUE(session->set(*found));
  const auto off = session->automatic(0);
  ASSERT_TRUE(off);
  for (const double one : std::get<std::vector<double>>(*off->p)) EXPECT_EQ(one, 2);
  EXPECT_EQ(session->automatic(1.5).error().reason, "STRENGTH_OUT_OF_RANGE");
}

TEST(CoreLibrary, WritesAMeshThatItReads) {
  const std::string path = testing::TempDir() + "core_library_test.ply";
  Mesh mesh = sheet();
  mesh.vertices[1] = 1.0 / 3;
  ASSERT_TRUE(write_mesh(path, mesh));
  const auto read = read_mesh(path);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->vertices, mesh.vertices);
  EXPECT_EQ(read->faces, mesh.faces);
  std::remove(path.c_str());
  EXPECT_EQ(said(read_mesh(path)).at(0), "MESH_FILE_NOT_FOUND");
  EXPECT_EQ(said(write_mesh("shape.step", mesh)).at(0), "MESH_FORMAT_UNKNOWN");
}

TEST(CoreLibrary, WritesNoPositionsThatAreNotFinite) {
  for (const char* ending : {"obj", "off", "ply", "glb", "gltf"}) {
    const std::string path = testing::TempDir() + "core_library_test." + ending;
    for (const double wrong :
         {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
      Mesh mesh = sheet();
      mesh.vertices[4] = wrong;
      EXPECT_THAT(said(write_mesh(path, mesh)),
                  ElementsAre("MESH_NOT_FINITE", "vertex 1", "finite coordinates"));
    }
    EXPECT_EQ(said(read_mesh(path)).at(0), "MESH_FILE_NOT_FOUND") << "nothing is written";
  }
}

}  // namespace
}  // namespace lpdeform::core
