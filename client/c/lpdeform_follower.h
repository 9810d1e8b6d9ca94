#pragma once

#include <lpdeform.h>

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

/// An engine's coordinates. The fields are those of lpdeform_options.
struct LpdeformSpace {
  lpdeform_handedness handedness;
  lpdeform_up up;
  lpdeform_winding winding;
  double units_per_metre;
};

/// Unreal's normal of A, B, C is (C - A) x (B - A).
inline constexpr LpdeformSpace kUnrealSpace{LPDEFORM_LEFT_HANDED, LPDEFORM_Z_UP, LPDEFORM_COUNTER_CLOCKWISE,
                                            100};
inline constexpr LpdeformSpace kGodotSpace{LPDEFORM_RIGHT_HANDED, LPDEFORM_Y_UP, LPDEFORM_CLOCKWISE, 1};

struct LpdeformServer {
  std::string address = {};  // as lpdeform_connection.address
  std::string token = {};    // may be empty
  bool tls = false;
};

/// Coordinates are those of the engine. Vertices in the same place deform as one.
struct LpdeformShape {
  std::vector<float> positions;        // x, y, z of each vertex
  std::vector<float> normals;          // the same at rest, or empty: frames then have smooth normals
  std::vector<std::uint32_t> indices;  // three per triangle
};

/// How the server looks for shapes of lower energy while nothing changes. Below p = 2 there are many minima.
struct LpdeformSearch {
  /// A shape that it finds is shown at once. Otherwise LpdeformFollower::notice() says that there is one.
  bool shows = false;
  /// Each unit, of up to 1000, stands for 12 starts; at 0 there are none. Negative: the server decides, which takes 1 where p is below 2,
  /// and otherwise 0. See lpdeform_settings.search_effort.
  int effort = -1;
  /// The share of the energy that such a shape must save, up to 1; 0 means 0.02.
  double least_share = 0;
};

/// A session for an engine's component, in C++17 around lpdeform.h. No function waits for the network, except take_better_shape(), and
/// the destructor, for at most about two seconds. The constructor throws std::runtime_error; later errors are texts.
class LpdeformFollower {
 public:
  LpdeformFollower(const LpdeformServer& server, const LpdeformSpace& space, const LpdeformShape& shape) {
    lpdeform_connection connection{};
    connection.struct_size = sizeof connection;
    connection.address = server.address.c_str();
    connection.token = server.token.empty() ? nullptr : server.token.c_str();
    connection.tls = server.tls ? 1 : 0;
    if (lpdeform_connect(&connection, &client_, &error_) != LPDEFORM_OK)
      throw std::runtime_error(error_.message);
    lpdeform_mesh mesh{};
    mesh.struct_size = sizeof mesh;
    mesh.vertex_count = static_cast<std::uint32_t>(shape.positions.size() / 3);
    mesh.positions.data = shape.positions.data();
    mesh.positions.bytes = shape.positions.size() * sizeof(float);
    if (!shape.normals.empty()) mesh.normals.data = shape.normals.data();
    mesh.normals.bytes = shape.normals.size() * sizeof(float);
    mesh.indices = shape.indices.data();
    mesh.index_count = static_cast<std::uint32_t>(shape.indices.size());
    mesh.weld_by_position = 1;
    lpdeform_options options{};
    options.struct_size = sizeof options;
    options.handedness = space.handedness;
    options.up = space.up;
    options.winding = space.winding;
    options.units_per_metre = space.units_per_metre;
    options.free_components = LPDEFORM_FREE_COMPONENTS_FOLLOW;
    options.with_normals = 1;
    if (lpdeform_open(client_, &mesh, &options, &session_, &error_) != LPDEFORM_OK) {
      const std::string why = error_.message;
      lpdeform_disconnect(client_);
      throw std::runtime_error(why);
    }
    positions_ = shape.positions;
    normals_.resize(positions_.size());
    colours_.resize(4 * (positions_.size() / 3));
  }

  ~LpdeformFollower() {
    lpdeform_close(session_);
    lpdeform_disconnect(client_);
  }

  LpdeformFollower(const LpdeformFollower&) = delete;
  LpdeformFollower& operator=(const LpdeformFollower&) = delete;

  /// False: problem() says why.
  bool hold(const std::string& name, const std::vector<std::uint32_t>& vertices) {
    lpdeform_handle handle{};
    handle.struct_size = sizeof handle;
    handle.name = name.c_str();
    handle.vertices = vertices.data();
    handle.vertex_count = static_cast<std::uint32_t>(vertices.size());
    return said(lpdeform_set_handle(session_, &handle, nullptr, &error_));
  }

  /// Removes the handle. False: problem() says why.
  bool let_go(const std::string& name) {
    return said(lpdeform_remove_handle(session_, name.c_str(), nullptr, &error_));
  }

  /// Where the handle is, relative to the mesh at rest: a rotation about the origin (x, y, z, w), then a shift. Does not wait.
  bool move(const char* name, const double (&rotation)[4], const double (&translation)[3]) {
    lpdeform_motion motion{};
    motion.kind = LPDEFORM_RIGID;
    for (int k = 0; k < 4; ++k) motion.rotation[k] = rotation[k];
    for (int k = 0; k < 3; ++k) motion.translation[k] = translation[k];
    return said(lpdeform_move_handle(session_, name, &motion, nullptr, &error_));
  }

  /// p, 1 to 64, everywhere. Does not wait. The server may refuse it later, as a whole: problem() then says why.
  bool set(double p, const LpdeformSearch& search) {
    lpdeform_settings settings{};
    settings.struct_size = sizeof settings;
    settings.p = p;
    settings.set_solver = settings.set_search = 1;
    settings.search_effort = search.effort < 0 ? 0 : search.effort == 0 ? -1 : search.effort;
    settings.search_shows = search.shows ? 1 : 0;
    settings.search_least_share = search.least_share;
    return said(lpdeform_set(session_, &settings, nullptr, &error_));
  }

  /// Once a tick: true where positions(), normals() and colours() are new. Does not wait.
  bool tick() {
    lpdeform_buffers buffers{};
    buffers.struct_size = sizeof buffers;
    buffers.positions = {positions_.data(), positions_.size() * sizeof(float), 0, 0, LPDEFORM_FLOAT32, 0};
    buffers.normals = {normals_.data(), normals_.size() * sizeof(float), 0, 0, LPDEFORM_FLOAT32, 0};
    buffers.colours = {colours_.data(), colours_.size(), 0, 0, LPDEFORM_RGBA8, 0};
    const lpdeform_code code = lpdeform_poll(session_, &buffers, &frame_, &error_);
    if (code != LPDEFORM_NO_FRAME) said(code);
    return code == LPDEFORM_OK;
  }

  const std::vector<float>& positions() const { return positions_; }
  const std::vector<float>& normals() const { return normals_; }
  const std::vector<std::uint8_t>& colours() const { return colours_; }

  /// Of the newest frame.
  const lpdeform_frame& frame() const { return frame_; }

  lpdeform_state state() const { return lpdeform_session_state(session_, nullptr); }

  /// Why the server cannot be reached for now; empty if it can be, or if no attempt has failed yet.
  std::string trouble() {
    return lpdeform_session_state(session_, &error_) == LPDEFORM_STATE_LIVE || error_.code == LPDEFORM_OK
               ? ""
               : text();
  }

  /// There is nothing more to come; problem() then says why.
  bool is_over() {
    if (lpdeform_session_state(session_, &error_) != LPDEFORM_STATE_REFUSED) return false;
    said(error_.code);
    return true;
  }

  /// The last thing that went wrong, once; empty where nothing did.
  std::string problem() { return std::exchange(problem_, {}); }

  /// What the server says of itself or of a better shape, once when it changes; otherwise empty. A still better shape is a change.
  std::string notice() {
    // The shape first: one that comes or goes meanwhile is told, or not, by the next call.
    lpdeform_better_shape better{};
    better.struct_size = sizeof better;
    const bool is_known = lpdeform_session_better_shape(session_, &better, nullptr) == LPDEFORM_OK;
    char text[512] = "";
    const lpdeform_notice now = lpdeform_session_notice(session_, text, sizeof text);
    if ((now == LPDEFORM_NOTICE_BETTER_SHAPE) != is_known) return {};
    const bool is_same = now == noticed_ && better.energy == noticed_energy_;
    noticed_ = now;
    noticed_energy_ = better.energy;
    return is_same ? std::string() : std::string(text);
  }

  /// Shows the shape of lower energy that notice() has announced, as a new frame. WAITS for the server's answer, 30 s at most. False:
  /// problem() says why.
  bool take_better_shape() { return said(lpdeform_take_better_shape(session_, &error_)); }

 private:
  bool said(lpdeform_code code) {
    if (code != LPDEFORM_OK) problem_ = text();
    return code == LPDEFORM_OK;
  }

  std::string text() const { return std::string(error_.message) + " (" + error_.reason + ")"; }

  lpdeform_error error_ = [] {
    lpdeform_error error{};
    error.struct_size = sizeof error;
    return error;
  }();
  lpdeform_frame frame_ = [] {
    lpdeform_frame frame{};
    frame.struct_size = sizeof frame;
    return frame;
  }();
  lpdeform_notice noticed_ = LPDEFORM_NOTICE_NONE;
  double noticed_energy_ = 0;  // of the better shape
  lpdeform_client* client_ = nullptr;
  lpdeform_session* session_ = nullptr;
  std::string problem_;
  std::vector<float> positions_, normals_;
  std::vector<std::uint8_t> colours_;
};
