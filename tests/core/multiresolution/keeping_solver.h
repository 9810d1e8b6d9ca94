#pragma once

#include <cmath>
#include <optional>
#include <vector>

#include "core/multiresolution/level_solver.h"

namespace lpdeform {

/// A solver of a level that keeps what it is given, and makes `steps` steps, each of which moves all vertices by up to `noise`, in the
/// caller's units, to and fro.
class KeepingSolver : public LevelSolver {
 public:
  explicit KeepingSolver(const RestShape& level, Field* bending = nullptr, int steps = 0, double noise = 0)
      : positions_(level.positions()),
        rotations_(level.vertex_count(), Eigen::Matrix3d::Identity()),
        bending_(bending),
        steps_(steps),
        noise_(noise) {}

  absl::Status set_material(const Material& /*material*/) override { return absl::OkStatus(); }
  void set_bending(const Field& shares) override {
    if (bending_ != nullptr) *bending_ = shares;
  }
  void displace(const Points& /*by*/) override {}
  std::optional<double> least_energy(InitialGuess /*initial*/, std::stop_token /*stop*/) override {
    return std::nullopt;
  }
  double lowest_energy() const override { return 0; }
  absl::Status set_handles(const HandleSet& /*handles*/) override { return absl::OkStatus(); }
  absl::Status set_positions(const Points& positions) override {
    positions_ = positions;
    return absl::OkStatus();
  }
  absl::Status start(const SolveSettings& /*settings*/, std::stop_token /*stop*/) override {
    return absl::OkStatus();
  }
  absl::Status start_prepared(const SolveSettings& /*settings*/, std::stop_token /*stop*/) override {
    return absl::OkStatus();
  }
  bool step() override {
    if (made_ == steps_) return false;
    ++made_;
    for (Eigen::Index i = 0; i < positions_.rows(); ++i)
      positions_(i, i % 3) += noise_ * std::sin(static_cast<double>(7 * i + made_));
    return true;
  }
  void catch_up(bool /*is_last*/) override {}
  int iterations() const override { return made_; }
  bool has_found_lower() const override { return false; }
  const Points& positions() const override { return positions_; }
  double energy() const override { return 0; }
  std::vector<Eigen::Matrix3d> rotations() override { return rotations_; }
  std::size_t memory_bytes() const override { return 0; }

 private:
  Points positions_;
  std::vector<Eigen::Matrix3d> rotations_;
  Field* bending_;
  int steps_;
  double noise_;
  int made_ = 0;
};

}  // namespace lpdeform
