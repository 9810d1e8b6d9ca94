#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "client/c/lpdeform.h"
#include "tests/client/c/shapes.h"
#include "tests/client/servers.h"

namespace lpdeform::engine {

// Shared by tests of the C interface against a server.

inline constexpr double kPatienceSeconds = 60;

/// Polls like a game; for a minute at most.
inline bool eventually(const std::function<bool()>& holds) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::duration<double>(kPatienceSeconds);
  while (!holds()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

/// A client of a server in this process, and one session at a time.
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

  std::vector<Point> settle(std::size_t count) {
    std::vector<Point> points(count);
    const lpdeform_buffers buffers = buffers_of(points);
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

}  // namespace lpdeform::engine
