// The C interface against a real server in this process.

#include <gmock/gmock.h>

#include <array>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "client/c/lpdeform.h"
#include "tests/client/in_process_server.h"

namespace lpdeform::engine {
namespace {

using testing::HasSubstr;

constexpr double kPatienceSeconds = 60;

/// As a game asks, again and again; a minute at most.
bool eventually(const std::function<bool()>& holds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatienceSeconds);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

using Point = std::array<float, 3>;

/// A strip in the plane y = 0, ten cells long in x and one wide in z; up and counter-clockwise seen from above, in the server's
/// coordinates.
struct Strip {
  Strip() {
    for (int k = 0; k <= 10; ++k) {
      points.push_back({float(k), 0, 1});
      points.push_back({float(k), 0, 0});
    }
    for (std::uint32_t k = 0; k < 20; k += 2) {
      for (const std::uint32_t corner : {0U, 2U, 3U, 0U, 3U, 1U}) indices.push_back(k + corner);
    }
  }

  lpdeform_mesh mesh() const {
    lpdeform_mesh out{};
    out.struct_size = sizeof out;
    out.vertex_count = static_cast<std::uint32_t>(points.size());
    out.positions = {points.data(), points.size() * sizeof(Point), 0, 0, LPDEFORM_FLOAT32, 0};
    out.indices = indices.data();
    out.index_count = static_cast<std::uint32_t>(indices.size());
    return out;
  }

  std::vector<Point> points;
  std::vector<std::uint32_t> indices;
};

class CSessionTest : public testing::Test {
 protected:
  CSessionTest() {
    error_.struct_size = sizeof error_;
    frame_.struct_size = sizeof frame_;
    options_.struct_size = sizeof options_;
    lpdeform_connection connection{};
    connection.struct_size = sizeof connection;
    address_ = server_.address();
    connection.address = address_.c_str();
    EXPECT_EQ(lpdeform_connect(&connection, &client_, &error_), LPDEFORM_OK) << error_.message;
  }

  ~CSessionTest() override {
    lpdeform_close(session_);
    lpdeform_disconnect(client_);
  }

  void open(const lpdeform_mesh& mesh) {
    ASSERT_EQ(lpdeform_open(client_, &mesh, &options_, &session_, &error_), LPDEFORM_OK) << error_.message;
  }

  std::uint64_t hold(const char* name, const std::vector<std::uint32_t>& vertices,
                     lpdeform_motion motion = {}) {
    lpdeform_handle handle{};
    handle.struct_size = sizeof handle;
    handle.name = name;
    handle.vertices = vertices.data();
    handle.vertex_count = static_cast<std::uint32_t>(vertices.size());
    handle.motion = motion;
    std::uint64_t seq = 0;
    EXPECT_EQ(lpdeform_set_handle(session_, &handle, &seq, &error_), LPDEFORM_OK) << error_.message;
    return seq;
  }

  static lpdeform_motion shift(double x, double y, double z) {
    lpdeform_motion motion{};
    motion.kind = LPDEFORM_RIGID;
    motion.translation[0] = x;
    motion.translation[1] = y;
    motion.translation[2] = z;
    return motion;
  }

  lpdeform_buffers into(std::vector<Point>& points) {
    lpdeform_buffers buffers{};
    buffers.struct_size = sizeof buffers;
    buffers.positions = {points.data(), points.size() * sizeof(Point), 0, 0, LPDEFORM_FLOAT32, 0};
    return buffers;
  }

  std::vector<Point> settle(std::size_t count) {
    std::vector<Point> points(count);
    const lpdeform_buffers buffers = into(points);
    EXPECT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, &frame_, &error_), LPDEFORM_OK)
        << error_.message;
    return points;
  }

  lpdeform_state state() { return lpdeform_session_state(session_, &error_); }

  client::InProcessServer server_;
  std::string address_;
  lpdeform_client* client_ = nullptr;
  lpdeform_session* session_ = nullptr;
  lpdeform_options options_{};
  lpdeform_error error_{};
  lpdeform_frame frame_{};
  Strip strip_;
};

TEST_F(CSessionTest, WorksThoughTheServerComesLater) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  lpdeform_motion up = shift(0, 2, 0);
  std::uint64_t seq = 0;
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, &seq, &error_), LPDEFORM_OK);
  EXPECT_EQ(seq, 3);
  std::vector<Point> points(22, Point{7, 7, 7});
  const lpdeform_buffers buffers = into(points);
  EXPECT_EQ(lpdeform_poll(session_, &buffers, &frame_, &error_), LPDEFORM_NO_FRAME);
  EXPECT_EQ(points[0][0], 7);
  EXPECT_TRUE(eventually(
      [&] { return state() == LPDEFORM_STATE_CONNECTING && error_.code == LPDEFORM_UNAVAILABLE; }));
  EXPECT_STREQ(error_.reason, "NO_SERVER");

  server_.start_again();
  points = settle(22);
  EXPECT_EQ(state(), LPDEFORM_STATE_LIVE);
  EXPECT_EQ(points[20][1], 2);
  EXPECT_EQ(points[0][1], 0);
  EXPECT_GE(frame_.input_seq, seq);
  EXPECT_EQ(frame_.converged, 1);
}

TEST_F(CSessionTest, NoFrameClaimsAChangeThatItDoesNotHave) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  const lpdeform_motion up = shift(0, 2, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_OK);
  server_.start_again();
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = into(points);
  EXPECT_TRUE(eventually([&] {
    if (lpdeform_poll(session_, &buffers, &frame_, &error_) != LPDEFORM_OK) return false;
    EXPECT_TRUE(frame_.input_seq == 0 || points[20][1] == 2) << frame_.input_seq;
    return frame_.input_seq == 3 && frame_.converged == 1;
  }));
}

TEST_F(CSessionTest, NumbersOfChangesGoOnFromThoseBeforeTheConnection) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  EXPECT_EQ(hold("tip", {20, 21}), 2);
  server_.start_again();
  settle(22);
  EXPECT_EQ(frame_.input_seq, 2);
  const lpdeform_motion up = shift(0, 1, 0);
  std::uint64_t seq = 0;
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, &seq, &error_), LPDEFORM_OK);
  EXPECT_EQ(seq, 3);
  settle(22);
  EXPECT_EQ(frame_.input_seq, 3);
}

TEST_F(CSessionTest, AMeshThatTheServerRefusesIsSaidByTheState) {
  strip_.indices[4] = 99;
  open(strip_.mesh());
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error_.reason, "MESH_INDEX_OUT_OF_RANGE");
  EXPECT_STREQ(error_.element, "face 1");
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = into(points);
  EXPECT_EQ(lpdeform_poll(session_, &buffers, &frame_, &error_), LPDEFORM_INVALID_ARGUMENT);
}

TEST_F(CSessionTest, ARefusedChangeIsSaidOnceAndTheSessionGoesOn) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  hold("beyond", {22});
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = into(points);
  int said = 0;
  const auto is_said = [&] {
    const lpdeform_code code = lpdeform_poll(session_, &buffers, &frame_, &error_);
    if (code == LPDEFORM_INVALID_ARGUMENT) ++said;
    return said == 1;
  };
  EXPECT_TRUE(eventually(is_said));
  EXPECT_STREQ(error_.reason, "HANDLE_VERTEX_OUT_OF_RANGE");
  EXPECT_STREQ(error_.element, "vertex 22");
  EXPECT_EQ(state(), LPDEFORM_STATE_LIVE);
  const lpdeform_motion up = shift(0, 1, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(settle(22)[20][1], 1);
}

TEST_F(CSessionTest, TheLastFrameStaysWhileTheServerIsAwayAndWorkGoesOnAfter) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 2, 0));
  settle(22);
  server_.stop();
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_RECONNECTING; }));
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = into(points);
  EXPECT_EQ(lpdeform_repeat(session_, &buffers, &frame_, &error_), LPDEFORM_OK);
  EXPECT_EQ(points[20][1], 2);
  const lpdeform_motion higher = shift(0, 3, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &higher, nullptr, &error_), LPDEFORM_OK);
  server_.start_again();  // it knows nothing of the session
  EXPECT_EQ(settle(22)[20][1], 3);
  EXPECT_EQ(state(), LPDEFORM_STATE_LIVE);
}

TEST_F(CSessionTest, ASessionIsOverAfterReconnectSeconds) {
  lpdeform_disconnect(client_);
  client_ = nullptr;
  server_.stop();
  lpdeform_connection connection{};
  connection.struct_size = sizeof connection;
  connection.address = address_.c_str();
  connection.reconnect_seconds = 0.05;
  ASSERT_EQ(lpdeform_connect(&connection, &client_, &error_), LPDEFORM_OK);
  open(strip_.mesh());
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_UNAVAILABLE);
}

TEST_F(CSessionTest, ClosingAndDisconnectingWithoutAServerEnds) {
  open(strip_.mesh());
  hold("base", {0, 1});
  settle(22);
  server_.stop();
  lpdeform_disconnect(client_);  // the session's end cannot be told to anybody
  client_ = nullptr;
  EXPECT_EQ(state(), LPDEFORM_STATE_REFUSED);
  EXPECT_STREQ(error_.reason, "SESSION_CLOSED");
}

TEST_F(CSessionTest, BuffersThatDoNotFitLoseNoFrame) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 2, 0));
  std::vector<Point> few(21);
  const lpdeform_buffers too_small = into(few);
  EXPECT_TRUE(eventually(
      [&] { return lpdeform_poll(session_, &too_small, &frame_, &error_) == LPDEFORM_INVALID_ARGUMENT; }));
  EXPECT_STREQ(error_.reason, "BUFFER_TOO_SMALL");
  EXPECT_STREQ(error_.limit, "bytes >= 264");
  EXPECT_EQ(settle(22)[20][1], 2);
}

TEST_F(CSessionTest, AReaderLooksOnAndChangesNothing) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 2, 0));
  const std::vector<Point> seen = settle(22);
  std::array<char, 64> name{};
  ASSERT_EQ(lpdeform_session_name(session_, name.data(), name.size(), &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_session_name(session_, name.data(), 10, &error_), LPDEFORM_INVALID_ARGUMENT);

  lpdeform_session* reader = nullptr;
  ASSERT_EQ(lpdeform_join(client_, name.data(), LPDEFORM_READER, nullptr, &reader, &error_), LPDEFORM_OK);
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = into(points);
  EXPECT_EQ(lpdeform_settle(reader, kPatienceSeconds, &buffers, &frame_, &error_), LPDEFORM_OK)
      << error_.message;
  EXPECT_EQ(lpdeform_vertex_count(reader), 22);
  EXPECT_EQ(points, seen);
  EXPECT_EQ(lpdeform_remove_handle(reader, "tip", nullptr, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NOT_THE_WRITER");
  lpdeform_close(reader);
}

TEST_F(CSessionTest, AnotherWriterTakesOverAndItsChangesBeforeItIsThereCount) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  std::array<char, 64> name{};
  ASSERT_EQ(lpdeform_session_name(session_, name.data(), name.size(), &error_), LPDEFORM_OK);

  lpdeform_session* writer = nullptr;
  ASSERT_EQ(lpdeform_join(client_, name.data(), LPDEFORM_WRITER, nullptr, &writer, &error_), LPDEFORM_OK);
  const lpdeform_motion up = shift(0, 1, 0);
  std::uint64_t seq = 0;
  ASSERT_EQ(lpdeform_move_handle(writer, "tip", &up, &seq, &error_), LPDEFORM_OK) << error_.message;
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = into(points);
  ASSERT_EQ(lpdeform_settle(writer, kPatienceSeconds, &buffers, &frame_, &error_), LPDEFORM_OK)
      << error_.message;
  EXPECT_EQ(points[20][1], 1);
  EXPECT_GE(frame_.input_seq, seq);

  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_ABORTED);
  EXPECT_STREQ(error_.reason, "WRITER_REPLACED");
  EXPECT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_ABORTED);
  lpdeform_close(writer);
}

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
    if (convention.handedness == LPDEFORM_LEFT_HANDED) {  // clockwise seen from above, as is usual there
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
    lpdeform_buffers buffers = into(points);
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

TEST_F(CSessionTest, ManyThreadsAtOnceAreFine) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      std::vector<Point> points(22);
      const lpdeform_buffers buffers = into(points);
      lpdeform_error error{};
      error.struct_size = sizeof error;
      for (int k = 0; k < 200; ++k) {
        const lpdeform_motion motion = shift(0, 0.001 * (k + t), 0);
        EXPECT_EQ(lpdeform_move_handle(session_, "tip", &motion, nullptr, &error), LPDEFORM_OK)
            << error.message;
        const lpdeform_code code = lpdeform_poll(session_, &buffers, nullptr, &error);
        EXPECT_TRUE(code == LPDEFORM_OK || code == LPDEFORM_NO_FRAME) << error.message;
        lpdeform_session_state(session_, &error);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const lpdeform_motion last = shift(0, 5, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &last, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(settle(22)[20][1], 5);
}

TEST_F(CSessionTest, SettingsAndFieldsReachTheSolver) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(-4, 3, 0));
  settle(22);
  const double even = frame_.energy;
  std::vector<double> p(22, 1.5);
  lpdeform_settings settings{};
  settings.struct_size = sizeof settings;
  settings.p_per_vertex = p.data();
  settings.p_count = 22;
  ASSERT_EQ(lpdeform_set(session_, &settings, nullptr, &error_), LPDEFORM_OK) << error_.message;
  settle(22);
  EXPECT_NE(frame_.energy, even);
  settings.p_count = 21;
  ASSERT_EQ(lpdeform_set(session_, &settings, nullptr, &error_), LPDEFORM_OK);
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = into(points);
  EXPECT_TRUE(eventually(
      [&] { return lpdeform_poll(session_, &buffers, &frame_, &error_) == LPDEFORM_INVALID_ARGUMENT; }));
  EXPECT_STREQ(error_.reason, "FIELD_SIZE");
}

}  // namespace
}  // namespace lpdeform::engine
