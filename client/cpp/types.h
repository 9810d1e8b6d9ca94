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

/// A triangle mesh as flat arrays. Neither client nor server changes the vertex order.
struct Mesh {
  /// x, y, z of each vertex, in the caller's unit of length.
  std::vector<double> vertices = {};
  /// Three 0-based vertex indices per triangle, counter-clockwise seen from outside.
  std::vector<std::uint32_t> faces = {};
  /// x, y, z of the normal with which each vertex is drawn at rest, of any length; 0 asks for the smooth normal. For
  /// frames with normals, see OpenOptions::with_normals; may be empty.
  std::vector<double> normals = {};

  std::size_t vertex_count() const { return vertices.size() / 3; }
  std::size_t face_count() const { return faces.size() / 3; }
};

/// Stays at its rest positions.
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

// How a handle is held. A target is the place to which the handle's motion moves a vertex or point.

/// Held exactly at its target.
struct Exactly {};

/// Pulled to its target: weight 0 releases the handle, 1 is about as strong as one edge of the surface. 0 to 1e6.
struct Soft {
  double weight = 1;
};

/// Has the rotation of the handle's motion; its position is free. For vertices only, without target positions. Weight 0
/// to 1e6.
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

/// A group of vertices, or of points inside faces, that the user holds. A vertex belongs to one handle at most.
struct Handle {
  std::vector<std::uint32_t> vertices = {};
  Motion motion = Fixed{};
  Hold hold = Exactly{};
  std::vector<SurfacePoint> points = {};  // instead of vertices; held exactly or softly
  /// Radius, along the surface, of the surroundings that move with the handle almost rigidly. Prevents the spike that a
  /// handle of one or a few vertices makes. 0: no footprint.
  double footprint = 0;
};

/// The vertices that may move. All others are held at their positions at the time when the region takes effect. Empty:
/// everything may move again.
struct RegionOfInterest {
  std::vector<std::uint32_t> vertices = {};
};

enum class Method { kAuto, kQuasiNewton, kLineSearch, kLocalGlobal, kConic, kMultiresolution };

enum class InitialGuess {
  kCurrent,    // the session's current state (warm start); for a new session, kLaplacian
  kLaplacian,  // the naive Laplacian deformation, no rotations
  kRest,       // the rest mesh with the handles at their targets
};

/// The weights of a cell's edges in the energy.
enum class WeightKind {
  kCotangent,          // max(0, (cot a + cot b) / 2), a and b the angles opposite the edge
  kUniform,            // 1 on every edge
  kIntrinsicDelaunay,  // cotangents of the intrinsic Delaunay triangulation: never clamped, on any mesh
};

/// What happens to a connected component that no handle holds.
enum class FreeComponents {
  kError,   // an error that names the component; nothing is solved
  kStay,    // stays at rest
  kFollow,  // moves rigidly with the nearest handle
};

/// How positions, distortion and normals are encoded in frames, from the most precise encoding to the smallest.
enum class Encoding {
  kRaw,  // float32, or float64 with OpenOptions::double_precision
  /// 16-bit integers. The largest errors are half of 1/65535 of the frame's extent along each axis, half of 1/65535 of
  /// its largest distortion, and half of 1/32767 for a component of a normal. Always includes the distortion.
  kQuantized,
  kCompressed,  // the same numbers, compressed by meshoptimizer's vertex codec
};

/// Which vertices of the mesh are copies of the same vertex: engines split vertices along seams of texture coordinates
/// and normals. Copies are deformed as one vertex and get the same positions to the last bit. Handles, fields and
/// positions still refer to the mesh's own vertices; values given for copies must be equal (COPIES_DIFFER).
struct Weld {
  bool by_position = false;  // vertices in the same place are copies
  /// The largest distance of such vertices, as a share of the bounding box's diagonal, 0 to 1e-3; 0 means the server's
  /// default, 1e-6. All copies get the position of the copy with the lowest index, also at rest.
  double tolerance = 0;
  /// If by_position is false: one number per vertex; vertices with the same number are copies. Empty: nothing is
  /// welded.
  std::vector<std::uint32_t> groups = {};
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

/// "iteration_limit" and so on, as in reports.
std::string stop_reason_name(StopReason reason);

/// How far to look for lower minima once the first one is found. The energy is not convex: it has many minima, above all
/// where p is below 2.
struct MinimaSearch {
  /// The number of further starts is 12 times the effort, 0 to 1000. 0 takes the first minimum. If left out: 1 if the
  /// method is kAuto and some p < 2, and for Session::solve if it also starts cold; otherwise 0. A start takes up to two
  /// or three times as long as the first minimum. Meshes of fewer than 100 vertices are not searched. Meshes of more than
  /// 15,000 vertices are searched on their coarse levels, and only what is lower there is tried on the mesh itself, as one
  /// further start.
  ///
  /// Session::solve finds the first minimum, then searches with what is left of its limits, and then answers. A session
  /// with an open stream shows the first minimum, and searches when nothing changes for a second. Session::solve makes it
  /// forget the shape that it has announced: Session::take_better_shape then fails with NO_BETTER_SHAPE, and the session
  /// searches again.
  std::optional<std::uint32_t> effort = {};
  /// What the session does with a lower minimum that it has found then. False: it announces it (Notice::kBetterShape), and
  /// Session::take_better_shape shows it. True: it shows it, as a new frame for the same update.
  bool show = false;
  /// The share of the energy that must be saved for this, 0 to 1; 0 means 0.02.
  double least_share = 0;
};

/// The method of a solve and when it stops. This is one setting: a new value replaces all fields.
struct SolverSettings {
  Method method = Method::kAuto;
  double tolerance = 0;              // 1e-14 to 0.1; 0 means the server's default
  std::uint32_t max_iterations = 0;  // 0 means the server's default
  double time_limit_seconds = 0;     // 0 means no limit
  InitialGuess initial = InitialGuess::kCurrent;
  std::optional<MinimaSearch> search = {};  // if left out, all its fields have their defaults
};

/// p or stiffness that the server computes from the shape's geometry: softer at joints (concave creases, and places
/// narrower than their surroundings), stiffer on rigid parts. With joint_i in [0, 1), p_i = 2 - c (1 - joint_i) and
/// s_i = 10^(-c joint_i), c = strength clamp((largest joint_i - 0.2) / 0.2, 0, 1). If no joint_i exceeds 0.2, p is 2 and
/// the stiffness 1 everywhere.
struct Automatic {
  double strength = 1;  // 0 to 1; 0 is p = 2 and stiffness 1 everywhere
};

/// The same number everywhere, one number per vertex, or computed from the geometry.
using FieldValue = std::variant<double, std::vector<double>, Automatic>;

/// A setting that is left out keeps its value.
struct Settings {
  std::optional<FieldValue> p = {};          // 1 <= p <= 64
  std::optional<FieldValue> stiffness = {};  // 1e-6 <= s <= 1e6
  /// The length unit of mixed norms, in the mesh's unit; 0 means the mean rest edge length.
  std::optional<double> length_unit = {};
  std::optional<SolverSettings> solver = {};
  std::optional<RegionOfInterest> region = {};
};

/// A scaling by different factors along three axes in which salient parts keep their shape and size. The server turns
/// it into the handle "resize", which holds the ends of each component along the scaled axes, and sets p and stiffness
/// unless the same update sets them. Along other axes the extent changes; hold the ends there with plane locks. To end
/// the resizing, remove that handle and set p and stiffness.
struct Resize {
  /// The factors along the axes, relative to the rest mesh; each 0.01 to 100. Apply a factor that all axes share to the
  /// mesh itself instead.
  std::array<double, 3> scale = {1, 1, 1};
  /// The point that does not move; default: the middle of the mesh's bounding box.
  std::optional<std::array<double, 3>> origin = {};
  /// The directions of the first and the second axis, of any length but 0; default: x and y of the mesh. Only the part
  /// of the second that is perpendicular to the first counts. The third axis is perpendicular to both.
  std::optional<std::array<std::array<double, 3>, 2>> axes = {};
};

/// A change of handles and settings. It is atomic: the server accepts all of it or nothing.
struct Update {
  /// Removes the handle.
  struct Removal {};
  /// A Handle adds or replaces the handle of that name; a Motion moves it.
  using Change = std::variant<Handle, Motion, Removal>;

  std::map<std::string, Change> handles = {};
  Settings settings = {};
  std::optional<Resize> resize = {};
  /// The changes of handles in this update begin a new step for Session::undo. Set this when a drag begins. Otherwise,
  /// consecutive updates that move the same handles, each at most a second after the previous one, are one step; every
  /// other update that changes handles is a step of its own. Settings are not part of steps.
  bool begins_step = false;
};

/// A message about the server's condition or about the session's surface; nothing failed.
struct Notice {
  enum class Reason {
    kOther,        // a reason that only newer servers send
    kOverloaded,   // frames come less often, and the final frame of an update later
    kRecovered,    // no longer overloaded
    kBetterShape,  // a shape of lower energy is known for the newest update: see MinimaSearch
  };
  Reason reason = Reason::kOther;
  std::string text = {};  // one sentence for people
  // Of kBetterShape only.
  std::uint64_t input_seq = 0;  // the update that the shape is for
  double energy = 0;            // of the shape
  double saved_share = 0;       // the share of the present energy that it saves, 0 to 1
};

/// A better shape that was taken: see Session::take_better_shape.
struct BetterShape {
  std::uint64_t input_seq = 0;  // the update that the shape is for
  double energy = 0;
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
  std::int64_t welded_vertices = 0;  // vertices that are copies of one with a lower index
  /// Warnings about the mesh, one sentence for people each: that the surface splits open where vertices are not welded.
  std::vector<std::string> notices = {};
};

/// A state of the surface on its way to the result.
struct Frame {
  std::vector<double> positions = {};  // x, y, z of each vertex
  /// E_i of each vertex, in the mesh's unit of length; empty if it was not requested.
  std::vector<double> distortion = {};
  /// x, y, z of a normal of length 1 for each vertex; empty if not requested. If Mesh::normals were given, these follow
  /// the surface (hard edges stay hard, seams are invisible); otherwise the normals are smooth.
  std::vector<double> normals = {};
  std::uint64_t input_seq = 0;  // the newest update that it includes: see Session::update; never decreases
  std::uint64_t frame_seq = 0;  // rises within an epoch
  std::uint64_t epoch = 0;
  std::uint64_t skipped_inputs = 0;  // updates since the previous frame for which there is no frame
  std::uint32_t iteration = 0;
  double energy = 0;       // E of the positions, Eq. 3 of the paper, in the mesh's unit, with soft terms
  double soft_energy = 0;  // the part of `energy` from soft and orientation handles
  /// The final frame for input_seq, however its solve ended (stop_reason). No further frame follows until there is a
  /// new update, except the same result with its optimality_gap, and a better shape that is taken or shown
  /// (MinimaSearch).
  bool is_final = false;
  StopReason stop_reason = StopReason::kRunning;
  double solve_seconds = 0;
  std::string method = {};
  /// The relative duality gap (E - lower bound) / E of the convex problem in which the rotations are held fixed. Only
  /// in results, and if requested: see OpenOptions::certify.
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
  /// x, y, z of each vertex; replaces the initial guess.
  std::optional<std::vector<double>> initial_positions = {};
  /// Called at most ten times per second, on the thread that called solve(). May be empty.
  std::function<void(const SolveProgress&)> on_progress = {};
  /// The deadline of the whole call, including the wait for another solve; 0 means no limit. At the deadline the server
  /// stops as well.
  double deadline_seconds = 0;
};

struct SolveResult {
  std::vector<double> positions = {};
  std::vector<double> distortion = {};
  std::vector<double> normals = {};  // as Frame::normals
  std::string method = {};           // the method that ran
  StopReason stop_reason = StopReason::kRunning;
  std::uint32_t iterations = 0;
  double initial_energy = 0;
  double energy = 0;       // including soft terms
  double soft_energy = 0;  // the part of the soft terms
  /// The relative duality gap (E - lower bound) / E of the convex problem in which the rotations are held fixed.
  std::optional<double> optimality_gap = {};
  double setup_seconds = 0;
  double solve_seconds = 0;
  std::uint32_t threads = 0;
  std::uint64_t input_seq = 0;
  std::vector<IterationRecord> trace = {};
  /// The energies of minima, in order: the first one, then one for each start of the search for lower ones (MinimaSearch)
  /// that has converged, or has come back to the lowest minimum, whose energy it then has. Several starts may come to the same
  /// minimum. Starts that were given up have no entry. `energy` is the lowest. Empty if a limit has ended the solve before the first.
  std::vector<double> minima = {};
  std::uint32_t further_starts = 0;     // of the search, including those that were given up
  std::uint32_t search_iterations = 0;  // the part of `iterations` that the search made
  std::uint32_t effort = 0;             // of the search: the one asked for, or the default
};

}  // namespace lpdeform::client
