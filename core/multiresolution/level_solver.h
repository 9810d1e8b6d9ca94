#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <stop_token>

#include "absl/status/status.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"
#include "core/problem/settings.h"

namespace lpdeform {

/// The solver of a coarse level: the part of the interface of Deformer (core/solve/deformer.h) that a level needs. It
/// may have a coarse level of its own. Each function does what the function of that name in Deformer does.
class LevelSolver {
 public:
  virtual ~LevelSolver() = default;

  virtual absl::Status set_material(const Material& material) = 0;
  virtual void set_bending(const Field& shares) = 0;
  virtual void displace(const Points& by) = 0;
  virtual std::optional<double> least_energy(InitialGuess initial, std::stop_token stop) = 0;
  virtual double lowest_energy() const = 0;
  virtual absl::Status set_handles(const HandleSet& handles) = 0;
  virtual absl::Status set_positions(const Points& positions) = 0;
  virtual absl::Status start(const SolveSettings& settings, std::stop_token stop) = 0;
  virtual absl::Status start_prepared(const SolveSettings& settings, std::stop_token stop) = 0;
  virtual bool step() = 0;
  virtual void catch_up(bool is_last) = 0;
  virtual int iterations() const = 0;  // of the running or the last solve
  /// Whether the last solve's search has found a minimum lower than its first, and has taken it (SolveSettings::effort).
  virtual bool has_found_lower() const = 0;
  virtual const Points& positions() const = 0;
  /// SolveSummary::energy of the last solve.
  virtual double energy() const = 0;
  virtual std::vector<Eigen::Matrix3d> rotations() = 0;
  /// Between its solves: it does not run while the finer level does.
  virtual std::size_t memory_bytes() const = 0;
};

/// Makes the solver for a level with this shape. Components without handles stay where they are. Null if that fails.
using MakeLevelSolver = std::function<std::unique_ptr<LevelSolver>(std::shared_ptr<const RestShape> shape)>;

}  // namespace lpdeform
