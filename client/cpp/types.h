#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

namespace lpdeform::client {

/// A triangle mesh as flat arrays. Vertex order is never changed by anybody.
struct Mesh {
  /// x, y, z of each vertex, in the caller's unit of length.
  std::vector<double> vertices = {};
  /// Three 0-based vertex indices a triangle, counter-clockwise seen from outside.
  std::vector<std::uint32_t> faces = {};
  /// x, y, z of a normal for each vertex as it is drawn, of any length; 0 asks for the smooth one. For frames
  /// with normals, see OpenOptions::with_normals; may be empty.
  std::vector<double> normals = {};

  std::size_t vertex_count() const { return vertices.size() / 3; }
  std::size_t face_count() const { return faces.size() / 3; }
};

/// Stays where the rest mesh has it.
struct Fixed {};

/// x = R (p - center) + center + translation for every vertex of the handle; always relative to the rest
/// mesh.
struct RigidMotion {
  std::array<double, 3> axis = {0, 0, 1};  // of any length but 0
  double angle_radians = 0;                // counter-clockwise seen against the axis
  std::array<double, 3> center = {0, 0, 0};
  std::array<double, 3> translation = {0, 0, 0};
};

/// Absolute positions: x, y, z for each of the handle's vertices or points, in their order.
struct TargetPositions {
  std::vector<double> positions = {};
};

using Motion = std::variant<Fixed, RigidMotion, TargetPositions>;

/// A point inside a face of the rest mesh: barycentric coordinates times the face's corners, in their order. Each
/// at least 0, their sum 1, both to 1e-6.
struct SurfacePoint {
  std::uint32_t face = 0;
  std::array<double, 3> barycentric = {1.0 / 3, 1.0 / 3, 1.0 / 3};
};

// How a handle is held; a target is where its motion sends a vertex or point.

/// Exactly at its target.
struct Exactly {};

/// Drawn to its target: 0 lets go, 1 is about as strong as one edge of the surface. 0 to 1e6.
struct Soft {
  double weight = 1;
};

/// Turned by the rotation of the handle's motion, its position free. Vertices only, no target positions. 0 to
/// 1e6.
struct Orientation {
  double weight = 100;
};

/// Free along a line through its target. Vertices only.
struct AxisLock {
  std::array<double, 3> axis = {0, 0, 1};  // of any length but 0
};

/// Free within a plane through its target. Vertices only.
struct PlaneLock {
  std::array<double, 3> normal = {0, 0, 1};  // of any length but 0
};

using Hold = std::variant<Exactly, Soft, Orientation, AxisLock, PlaneLock>;

/// A group of vertices, or of points inside faces, that the user holds. A vertex belongs to one handle at most.
struct Handle {
  std::vector<std::uint32_t> vertices = {};
  Motion motion = Fixed{};
  Hold hold = Exactly{};
  std::vector<SurfacePoint> points = {};  // in place of vertices; exactly or soft
  /// Radius, along the surface, of the surroundings that go along with the handle nearly rigidly: against the
  /// spike that a handle of one or a few vertices makes. 0: none.
  double footprint = 0;
};

/// The vertices that may move; everything outside is held where it is when the region takes effect. Empty:
/// everything may move again.
struct RegionOfInterest {
  std::vector<std::uint32_t> vertices = {};
};

enum class Method { kAuto, kQuasiNewton, kLineSearch, kLocalGlobal, kConic, kMultiresolution };

enum class InitialGuess {
  kCurrent,    // the session's present state; a new session's is kLaplacian
  kLaplacian,  // the naive Laplacian deformation, no rotations
  kRest,       // the rest mesh with the handles at their targets
};

/// Of a cell's edges in the energy.
enum class WeightKind {
  kCotangent,          // max(0, (cot a + cot b) / 2), a and b the angles opposite the edge
  kUniform,            // 1 on every edge
  kIntrinsicDelaunay,  // cotangents of the intrinsic Delaunay triangulation: never clamped, on any mesh
};

/// What becomes of a connected component that no handle holds.
enum class FreeComponents {
  kError,   // the solve is refused: the component is named
  kStay,    // stays where the rest mesh has it
  kFollow,  // moves rigidly with the nearest handle
};

/// How positions, distortion and normals travel in frames, from the most precise to the smallest.
enum class Encoding {
  kRaw,  // float32, or float64 with OpenOptions::double_precision
  /// 16-bit integers: off by at most half of 1/65535 of the frame's extent along each axis, of its largest distortion, and
  /// half of 1/32767 of a normal. Always with distortion.
  kQuantized,
  kCompressed,  // the same numbers, by meshoptimizer's vertex codec
};

/// Which vertices of the mesh are copies of one, as engines split them along seams of texture and normals.
/// They are deformed as one and get the same positions to the last bit. Handles, fields and positions go on
/// speaking of the mesh's own vertices; what is said of copies must be the same (COPIES_DIFFER).
struct Weld {
  bool by_position = false;  // vertices in the same place are one
  /// How far apart such vertices may be, as a share of the bounding box's diagonal, 0 to 1e-3; 0 is the server's, 1e-6. All
  /// copies get the position of the lowest, at rest, too.
  double tolerance = 0;
  /// Otherwise one number a vertex: those with the same number are one. Empty: nothing is welded.
  std::vector<std::uint32_t> groups = {};
};

enum class StopReason {
  kRunning,
  kConverged,
  kIterationLimit,
  kTimeLimit,
  kCancelled,
  kStalled,             // no step lowers the energy, short of the tolerance
  kNumericalBreakdown,  // the best state seen is kept
};

/// "iteration_limit" and so on, as in reports.
std::string stop_reason_name(StopReason reason);

/// How a solve is made and when it stops. One setting: it is replaced whole.
struct SolverSettings {
  Method method = Method::kAuto;
  double tolerance = 0;              // 1e-14 to 0.1; 0 takes the server's default
  std::uint32_t max_iterations = 0;  // 0 takes the server's default
  double time_limit_seconds = 0;     // 0 is without limit
  InitialGuess initial = InitialGuess::kCurrent;
};

/// p or stiffness from the shape's geometry, found by the server: softer at joints (concave creases, and places
/// narrower than what is around them), stiffer on rigid parts. With joint_i in [0, 1),
/// p_i = 2 - c (1 - joint_i) and s_i = 10^(-c joint_i), c = strength clamp((largest joint_i - 0.2) / 0.2, 0, 1):
/// p = 2 and stiffness 1 everywhere where no joint_i exceeds 0.2.
struct Automatic {
  double strength = 1;  // 0 to 1; 0 is p = 2 and stiffness 1 everywhere
};

/// The same number everywhere, one a vertex, or from the geometry.
using FieldValue = std::variant<double, std::vector<double>, Automatic>;

/// What is left out keeps its value.
struct Settings {
  std::optional<FieldValue> p = {};          // 1 <= p <= 64
  std::optional<FieldValue> stiffness = {};  // 1e-6 <= s <= 1e6
  /// Of mixed norms, in the mesh's unit; 0 takes the mean rest edge length.
  std::optional<double> length_unit = {};
  std::optional<SolverSettings> solver = {};
  std::optional<RegionOfInterest> region = {};
};

/// A scaling by different factors along three axes in which salient parts keep their shape and size. The server makes the
/// handle "resize" of it, which holds the ends of the mesh along the scaled axes (along others the extent changes: hold ends there with plane
/// locks), and sets p and stiffness, where the same update does not. To end it, remove that handle and set p and stiffness.
struct Resize {
  /// Along the axes, relative to the rest mesh; each 0.01 to 100. A factor that all share is better given to the mesh.
  std::array<double, 3> scale = {1, 1, 1};
  /// Stays where it is; the middle of the mesh's bounding box where left out.
  std::optional<std::array<double, 3>> origin = {};
  /// The directions of the first and the second axis, of any length; x and y of the mesh where left out. Of the
  /// second, the part across the first counts; the third is across both.
  std::optional<std::array<std::array<double, 3>, 2>> axes = {};
};

/// A change of handles and settings; the server takes it whole or not at all.
struct Update {
  /// Lets go of the handle.
  struct Removal {};
  /// A Handle adds or replaces, a Motion moves the handle of that name.
  using Change = std::variant<Handle, Motion, Removal>;

  std::map<std::string, Change> handles = {};
  Settings settings = {};
  std::optional<Resize> resize = {};
  /// What it does to handles is a step of its own, which Session::undo takes back: to be set when a drag begins. Otherwise updates
  /// that move the same handles, none of them over a second after the one before, are one step, and each other update
  /// that changes handles is one. Settings are no part of steps.
  bool begins_step = false;
};

/// What a server says about itself; nothing failed.
struct Notice {
  enum class Reason {
    kOther,       // what only a newer server says
    kOverloaded,  // it has more to solve than it can: frames come less often, and the last one of an update later
    kRecovered,  // no more
  };
  Reason reason = Reason::kOther;
  std::string text = {};  // one sentence for people
};

/// One kind of defect of a mesh.
struct Defect {
  std::string kind = {};  // "zero_area_faces"
  std::int64_t count = 0;
  std::vector<std::int32_t> first = {};  // the first few by index; an edge is two vertex indices
};

struct MeshReport {
  std::int64_t vertices = 0;
  std::int64_t faces = 0;
  std::int64_t edges = 0;
  std::int64_t components = 0;
  std::int64_t boundary_loops = 0;
  std::vector<Defect> defects = {};  // every kind, also those with count 0
  std::int64_t welded_vertices = 0;  // copies of a vertex before them
  /// What is to be known before the mesh is deformed, one sentence for people each: that it comes apart where it is split.
  std::vector<std::string> notices = {};
};

/// A state of the surface on its way to the optimum.
struct Frame {
  std::vector<double> positions = {};  // x, y, z of each vertex
  /// E_i of each vertex, in the mesh's unit of length; empty where it was not asked for.
  std::vector<double> distortion = {};
  /// x, y, z of a normal of length 1 for each vertex; empty where it was not asked for. Carried from
  /// Mesh::normals where those were given (hard edges stay hard, seams do not show), otherwise smooth.
  std::vector<double> normals = {};
  std::uint64_t input_seq = 0;  // the newest update it answers: see Session::update; never falls
  std::uint64_t frame_seq = 0;  // rises within an epoch
  std::uint64_t epoch = 0;
  std::uint64_t skipped_inputs = 0;  // updates since the frame before that no frame answers
  std::uint32_t iteration = 0;
  double energy = 0;       // E of the positions, Eq. 3 of the paper, in the mesh's unit, with soft terms
  double soft_energy = 0;  // the part of it that soft and orientation handles have
  /// The result for input_seq, however its solve ended (stop_reason): no further frame until there is a new update, but for the
  /// same one with its gap.
  bool is_final = false;
  StopReason stop_reason = StopReason::kRunning;
  double solve_seconds = 0;
  std::string method = {};
  /// (E - lower bound) / E of the convex problem with its rotations held. In results alone, where asked for: see
  /// OpenOptions::certify.
  std::optional<double> optimality_gap = {};
};

struct IterationRecord {
  std::uint32_t iteration = 0;
  double seconds = 0;
  double energy = 0;     // the true one
  double objective = 0;  // what the method minimises, in its own unit
  std::uint32_t stage = 0;
};

struct SolveProgress {
  std::uint32_t iteration = 0;
  double energy = 0;
  double seconds = 0;
};

struct SolveOptions {
  bool certify = false;          // compute SolveResult::optimality_gap
  bool keep_trace = false;       // fill SolveResult::trace
  bool double_precision = true;  // positions, distortion and normals travel as float64
  bool with_normals = false;     // fill SolveResult::normals
  /// x, y, z of each vertex, in place of the initial guess.
  std::optional<std::vector<double>> initial_positions = {};
  /// Called at most ten times a second, on the thread that called solve(). May be empty.
  std::function<void(const SolveProgress&)> on_progress = {};
  /// Of the whole call, waiting for another one included; 0 is without limit. When it has passed, the server stops as well.
  double deadline_seconds = 0;
};

struct SolveResult {
  std::vector<double> positions = {};
  std::vector<double> distortion = {};
  std::vector<double> normals = {};  // as Frame::normals
  std::string method = {};           // that ran
  StopReason stop_reason = StopReason::kRunning;
  std::uint32_t iterations = 0;
  double initial_energy = 0;
  double energy = 0;       // with soft terms
  double soft_energy = 0;  // their part
  /// (E - lower bound) / E of the convex problem with its rotations held.
  std::optional<double> optimality_gap = {};
  double setup_seconds = 0;
  double solve_seconds = 0;
  std::uint32_t threads = 0;
  std::uint64_t input_seq = 0;
  std::vector<IterationRecord> trace = {};
};

}  // namespace lpdeform::client
