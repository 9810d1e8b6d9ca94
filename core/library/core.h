#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "core/library/mesh_file.h"
#include "core/library/result.h"
#include "core/library/types.h"

/// Deforms triangle meshes by handles, so that the L_p distortion energy of Gao, Zhang and Lai, "L_p shape deformation"
/// (Science China Information Sciences 55, 2012, doi 10.1007/s11432-012-4574-y), is least:
///
///   E = sum_i s_i l^2 (E_i / l)^p,   E_i^2 = min over rotations R of sum_j w_ij |(x_i - x_j) - R (p_i - p_j)|^2
///
/// with the stiffness s_i and the length unit l of Settings. With p = 2 it is that of Sorkine and Alexa,
/// "As-rigid-as-possible surface modeling" (2007).
///
///   using namespace lpdeform::core;
///   auto result = deform(mesh, {{"base", {.vertices = base}},
///                               {"tip", {.vertices = tip, .motion = RigidMotion{.translation = {0, 0, 1}}}}},
///                        {.p = 1.5});
///   use(result.value().positions);
///
/// Errors are Result values with a reason, an element and a limit. No function throws but value() of a Result that is an error, and
/// what a function of the caller throws.
namespace lpdeform::core {

/// Solves once. Errors: those of Session::open, set_handles, set and solve.
Result<SolveResult> deform(const Mesh& mesh, const Handles& handles, const Settings& settings = {},
                           const SolveOptions& options = {}, const OpenOptions& open_options = {});

/// A mesh being deformed: handles and settings may change between solves, and each solve goes on from the present shape.
/// One thread at a time uses a session; different sessions are independent.
class Session {
 public:
  /// Takes a copy of the mesh. Errors: MESH_SIZE (not three numbers for each vertex and face), MESH_EMPTY,
  /// MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE, MESH_NO_AREA, MESH_SCALE, FACTOR_TOO_LARGE, THREADS_OUT_OF_RANGE.
  static Result<Session> open(const Mesh& mesh, const OpenOptions& options = {});
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;
  ~Session();

  MeshReport report() const;

  /// Adds the handle or replaces the one of that name. Errors: the reasons that begin with HANDLE_.
  Result<void> set_handle(std::string_view name, const Handle& handle);
  /// Replaces all handles.
  Result<void> set_handles(const Handles& handles);
  /// Moves a handle. HANDLE_UNKNOWN if there is none of that name.
  Result<void> move(std::string_view name, const Motion& motion);
  /// Does nothing if there is no handle of that name.
  void remove(std::string_view name);
  /// Errors: FIELD_SIZE, P_OUT_OF_RANGE, STIFFNESS_OUT_OF_RANGE, LENGTH_UNIT_OUT_OF_RANGE, REGION_VERTEX_OUT_OF_RANGE.
  Result<void> set(const Settings& settings);
  /// p and stiffness from the geometry, for set(): joints bend, parts stay rigid. `strength` is 0 (p = 2 and stiffness 1
  /// everywhere) to 1. Errors: STRENGTH_OUT_OF_RANGE.
  Result<Settings> automatic(double strength = 1) const;
  /// Makes this the present shape. Errors: POSITIONS_SIZE, POSITIONS_NOT_FINITE.
  Result<void> set_positions(const std::vector<double>& positions);

  /// Solves for the present handles and settings. Errors: NO_HANDLES, COMPONENT_WITHOUT_HANDLE, HANDLE_TARGET_TOO_FAR,
  /// HANDLE_CONSTRAINTS_DEPENDENT, METHOD_NEEDS_P, METHOD_NEEDS_EXACT_HANDLES, EFFORT_OUT_OF_RANGE, TOLERANCE_OUT_OF_RANGE,
  /// ITERATIONS_OUT_OF_RANGE, TIME_LIMIT_OUT_OF_RANGE. A solve that ends at a limit is a result, not an error.
  Result<SolveResult> solve(const SolveOptions& options = {});

  /// Begins a solve that step() goes on with, for a caller with a loop of its own. Errors as solve(). Any change of
  /// handles or settings ends it.
  Result<void> start(const SolveOptions& options = {});
  /// Makes one iteration. False when the solve has ended.
  bool step();
  /// The best shape so far and what is known about it; at rest before the first solve.
  SolveResult result() const;

 private:
  struct Impl;
  explicit Session(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

/// Makes one vertex of vertices that lie in the same place, as along the seams of a mesh made for drawing. `tolerance` is a
/// share of the bounding box's diagonal, 0 to 1e-3; 0 is 1e-6. Errors: MESH_SIZE, WELD_TOLERANCE, WELD_TOO_DENSE.
Result<WeldedMesh> weld(const Mesh& mesh, double tolerance = 0);

/// The mesh alone of a file. Errors: those of MeshFile::read().
Result<Mesh> read_mesh(const std::string& path);

/// A file with this mesh and nothing else: GLB, glTF, OFF, OBJ or PLY, by the ending of `path`, completely or not at all. Errors:
/// MESH_SIZE, MESH_INDEX_OUT_OF_RANGE, MESH_FORMAT_UNKNOWN, MESH_NOT_FINITE, FILE_NOT_WRITTEN; for GLB and glTF also MESH_EMPTY,
/// MESH_NO_AREA and MESH_UNSUPPORTED.
Result<void> write_mesh(const std::string& path, const Mesh& mesh);

/// "0.1.0": the version of the library that the program runs with.
const char* version();

}  // namespace lpdeform::core
