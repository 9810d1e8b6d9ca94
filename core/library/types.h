#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <variant>
#include <vector>

/// What is given to the library and what it gives back: values of the standard library only. Handles have the names and
/// the fields of the C++ client (client/cpp/types.h). Lengths are in the caller's unit, angles in radians. Points are flat
/// arrays x, y, z, x, y, z, ...
namespace lpdeform::core {

/// A triangle mesh. The vertex order is never changed.
struct Mesh {
  std::vector<double> vertices = {};  // 3 numbers each
  std::vector<std::uint32_t> faces =
      {};  // 3 vertex indices each, from 0, counter-clockwise seen from outside
};

/// Stays at its rest positions.
struct Fixed {};

/// x = R (p - center) + center + translation for every vertex of the handle, p its position at rest.
struct RigidMotion {
  std::array<double, 3> axis = {0, 0, 1};  // of any length but 0
  double angle_radians = 0;                // counter-clockwise seen against the axis
  std::array<double, 3> center = {0, 0, 0};
  std::array<double, 3> translation = {0, 0, 0};
};

/// Absolute positions: 3 numbers for each of the handle's vertices or points, in their order.
struct TargetPositions {
  std::vector<double> positions = {};
};

using Motion = std::variant<Fixed, RigidMotion, TargetPositions>;

/// A point inside a face of the rest mesh: barycentric coordinates times the face's corners. Each is at least 0, their sum
/// 1, both to 1e-6.
struct SurfacePoint {
  std::uint32_t face = 0;
  std::array<double, 3> barycentric = {1.0 / 3, 1.0 / 3, 1.0 / 3};
};

/// Held exactly at the target: the place to which the handle's motion moves a vertex or point.
struct Exactly {};

/// Pulled to its target: weight 0 releases it, 1 is about as strong as one edge of the surface; 0 to 1e6.
struct Soft {
  double weight = 1;
};

/// Has the rotation of the handle's motion; its position is free. For vertices only. Weight 0 to 1e6.
struct Orientation {
  double weight = 100;
};

/// Free to move along a line through its target. For vertices only.
struct AxisLock {
  std::array<double, 3> axis = {0, 0, 1};  // of any length but 0
};

/// Free to move within a plane through its target. For vertices only.
struct PlaneLock {
  std::array<double, 3> normal = {0, 0, 1};  // of any length but 0
};

using Hold = std::variant<Exactly, Soft, Orientation, AxisLock, PlaneLock>;

/// A group of vertices, or of points inside faces, that is held. A vertex belongs to one handle at most.
struct Handle {
  std::vector<std::uint32_t> vertices = {};
  Motion motion = Fixed{};
  Hold hold = Exactly{};
  std::vector<SurfacePoint> points = {};  // instead of vertices; held Exactly or Soft
  double footprint = 0;  // radius of the surroundings that move with the handle almost rigidly; 0: none
};

/// Handles by name. A name has 1 to 128 bytes.
using Handles = std::map<std::string, Handle>;

/// The same number everywhere, or one for each vertex.
using FieldValue = std::variant<double, std::vector<double>>;

/// How distortion is spread, and what may move. A setting that is left out keeps its value.
struct Settings {
  std::optional<FieldValue> p = {};          // 1 to 64; 2 to begin with
  std::optional<FieldValue> stiffness = {};  // 1e-6 to 1e6; 1 to begin with
  std::optional<double> length_unit = {};    // of mixed norms; 0, the default, is the mean rest edge length
  /// Only these vertices may move; the others are held where they are when the next solve begins. Empty: all may move.
  std::optional<std::vector<std::uint32_t>> region = {};
};

/// The weights of edges in the energy.
enum class WeightKind {
  kCotangent,          // max(0, (cot a + cot b) / 2), a and b the angles opposite the edge
  kUniform,            // 1 on every edge
  kIntrinsicDelaunay,  // cotangents of the intrinsic Delaunay triangulation: never clamped, on any mesh
};

/// What happens to a connected component that no handle holds.
enum class FreeComponents {
  kError,   // solves are refused with an error that names it
  kStay,    // stays at rest
  kFollow,  // moves rigidly with the nearest handle
};

struct OpenOptions {
  WeightKind weights = WeightKind::kCotangent;
  FreeComponents free_components = FreeComponents::kError;
  int threads =
      0;  // 1 to 1024; 0: as many as there are cores. A solve has at most one for each 1,000 vertices. Results are the same on any number.
};

enum class Method { kAuto, kQuasiNewton, kMultiresolution, kLineSearch, kLocalGlobal, kConic };

enum class InitialGuess {
  kCurrent,    // the present shape; the first solve begins as kLaplacian
  kLaplacian,  // the Laplacian deformation, without rotations
  kRest,       // the rest mesh with the handles at their targets
};

enum class StopReason {
  kRunning,
  kConverged,
  kIterationLimit,
  kTimeLimit,
  kCancelled,
  kStalled,             // no step decreases the energy, but the tolerance is not met
  kNumericalBreakdown,  // the result is the best state so far
};

struct Progress {
  int iteration = 0;
  double energy = 0;
  double seconds = 0;
};

struct SolveOptions {
  Method method = Method::kAuto;
  InitialGuess initial = InitialGuess::kCurrent;
  double tolerance = 1e-5;      // of the relative decrease of the energy that is still expected; 1e-14 to 0.1
  int max_iterations = 100000;  // at least 0
  double time_limit_seconds = std::numeric_limits<double>::infinity();  // above 0
  /// How far to look for lower minima: 12 further starts for each unit, 0 to 1000. Left out: 1 for the first solve if some
  /// p < 2 and the method is kAuto, otherwise 0.
  std::optional<int> effort = {};
  bool certify = false;  // fills SolveResult::optimality_gap
  /// Ends the solve with kCancelled within one iteration, from any thread. The session goes on with the best shape so far.
  std::stop_token stop = {};
  /// Called after each iteration, on the thread that solves. Must not throw.
  std::function<void(const Progress&)> on_progress = {};
};

struct SolveResult {
  std::vector<double> positions = {};   // 3 numbers for each vertex
  std::vector<double> distortion = {};  // E_i >= 0 of each vertex, a length
  StopReason stop_reason = StopReason::kRunning;
  int iterations = 0;
  double energy = 0;       // E of core.h, with the soft terms
  double soft_energy = 0;  // the part of the soft terms
  /// (E - lower bound) / E of the convex problem with the rotations held; empty if it was not asked for.
  std::optional<double> optimality_gap = {};
  double setup_seconds = 0;
  double solve_seconds = 0;
  /// Border vertices in the same place as another one. Where there are any, the mesh comes apart: see weld().
  std::int64_t split_border_vertices = 0;
  /// The energies of minima, in order: the first one, then one for each start of the search for lower ones
  /// (SolveOptions::effort) that has converged, or has come back to the lowest minimum, whose energy it then has. Several starts may
  /// come to the same minimum. Starts that were given up have no entry. `energy` is the lowest. Empty if a limit has ended the solve
  /// before the first.
  std::vector<double> minima = {};
  int further_starts = 0;     // of the search, including those that were given up
  int search_iterations = 0;  // the part of `iterations` that the search made
  int effort = 0;             // of the search: the one asked for, or the default
};

/// A mesh in which vertices that lie in the same place are one: see weld().
struct WeldedMesh {
  Mesh mesh = {};                             // what to open; the faces are in the order given
  std::vector<std::uint32_t> vertex_of = {};  // for each vertex that was given, which one of `mesh` it is

  /// Numbers of the vertices of `mesh`, one or more for each, as those of the vertices that were given: positions or
  /// distortion for drawing.
  std::vector<double> spread(const std::vector<double>& numbers) const {
    const std::size_t width = numbers.size() / std::max<std::size_t>(mesh.vertices.size() / 3, 1);
    std::vector<double> all;
    all.reserve(width * vertex_of.size());
    for (const std::uint32_t vertex : vertex_of) {
      const auto from = numbers.begin() + static_cast<std::ptrdiff_t>(width * vertex);
      all.insert(all.end(), from, from + static_cast<std::ptrdiff_t>(width));
    }
    return all;
  }
};

/// What to know about a mesh before deforming it.
struct MeshReport {
  std::int64_t vertices = 0, faces = 0, components = 0;
  std::int64_t unreferenced_vertices = 0;  // stay where they are
  /// Vertices at a border that lie in the same place as others at a border. The surface splits open there: weld() the mesh
  /// before.
  std::int64_t split_border_vertices = 0;
};

}  // namespace lpdeform::core
