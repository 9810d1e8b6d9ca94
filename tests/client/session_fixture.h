#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/files/mesh_input.h"
#include "client/cli/generated_shape.h"
#include "client/cpp/client.h"
#include "core/shapes/shapes.h"
#include "tests/client/in_process_server.h"

namespace lpdeform::client {

inline constexpr std::chrono::seconds kPatience{60};

/// The paper's bar with both ends held and the middle twisted by `degrees`.
class SessionTest : public testing::Test {
 protected:
  static Motion twist(double degrees) {
    return RigidMotion{.angle_radians = degrees * std::numbers::pi / 180, .center = {2, 2, 10.5}};
  }

  static Update bar_handles(double degrees) {
    Update update;
    cli::GeneratedShape shape = cli::generate_shape("bar", 1).value();
    for (cli::NamedHandle& handle : shape.handles) {
      if (handle.name == "middle") handle.handle.motion = twist(degrees);
      update.handles.emplace(std::move(handle.name), std::move(handle.handle));
    }
    return update;
  }

  static std::vector<std::uint32_t> vertices_of(const std::string& name) {
    return std::get<Handle>(bar_handles(0).handles.at(name)).vertices;
  }

  static Mesh bar() { return cli::to_client(box_surface(4, 4, 21)); }

  absl::StatusOr<Client> connect() { return Client::connect(server_.address()); }

  /// A session of the twisted bar.
  Session open_bar(OpenOptions options = {}) {
    Session session = connect()->open(bar(), std::move(options)).value();
    session.update(bar_handles(90)).value();
    return session;
  }

  InProcessServer server_;
};

/// The largest difference of two results in a coordinate.
inline double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double most = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

}  // namespace lpdeform::client
