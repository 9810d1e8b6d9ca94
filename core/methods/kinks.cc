#include "core/methods/kinks.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "core/energy/rotation_fit.h"

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 512;  // cells
/// There are kinks if this share of the cells has more than kMuch of the objective.
constexpr double kFew = 0.001, kMuch = 0.5;
/// The cells that are eased: this share of all, and this many rings of vertices around them, but no further ring once there are kMost of
/// all vertices.
constexpr double kEased = 0.005, kMost = 0.05;
constexpr int kRings = 3;
constexpr int kSweeps = 5;
constexpr double kDamping = 2.0 / 3;  // of relax()

std::vector<double> terms_of(const Problem& problem) {
  const std::vector<double>& squares = problem.objective.cells().squared_energies();
  std::vector<double> terms(squares.size());
  problem.workers().for_chunks(terms.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i)
      terms[i] = problem.norm.term(static_cast<std::int32_t>(i), squares[i]).value;
  });
  return terms;
}

/// The vertices of some cells and of those around them.
class Patch {
 public:
  Patch(const Problem& problem, std::vector<std::int32_t> centres)
      : problem_(problem), vertices_(std::move(centres)), place_(problem.shape().vertex_count(), -1) {
    for (const std::int32_t i : vertices_) place_[i] = 0;
    std::size_t begin = 0;
    const double most = kMost * problem.shape().cell_count();
    for (int ring = 0; ring < kRings && static_cast<double>(vertices_.size()) < most; ++ring)
      begin = add_ring(begin);
    std::ranges::sort(vertices_);
    const std::size_t inner = vertices_.size();
    (void)add_ring(0);  // their rotations count, but they stay
    for (std::size_t k = 0; k < vertices_.size(); ++k) place_[vertices_[k]] = static_cast<std::int32_t>(k);
    rotations_.resize(vertices_.size());
    moves_.assign(vertices_.begin(), vertices_.begin() + static_cast<std::ptrdiff_t>(inner));
    std::erase_if(moves_, [&](std::int32_t i) { return problem.constraints.is_held[i] != 0; });
  }

  /// The vertices that sweep() moves.
  const std::vector<std::int32_t>& moves() const { return moves_; }

  void sweep(Points& x) {
    problem_.workers().for_chunks(vertices_.size(), kChunk,
                                  [&](std::size_t, std::size_t begin, std::size_t end) {
                                    for (std::size_t k = begin; k < end; ++k) fit(x, k);
                                  });
    for (const std::int32_t i : moves_) move(x, i);
  }

 private:
  /// Adds the neighbours of the vertices from `begin` on. Returns where they begin.
  std::size_t add_ring(std::size_t begin) {
    const RestShape& shape = problem_.shape();
    const std::size_t end = vertices_.size();
    for (; begin < end; ++begin) {
      const std::int32_t i = vertices_[begin];
      for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
        const std::int32_t j = shape.neighbours()[k];
        if (place_[j] < 0) place_[j] = 0, vertices_.push_back(j);
      }
    }
    return end;
  }

  void fit(const Points& x, std::size_t place) {
    const RestShape& shape = problem_.shape();
    const Points& rest = shape.scaled_positions();
    const std::int32_t i = vertices_[place];
    Eigen::Matrix3d b = Eigen::Matrix3d::Zero();
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      const std::int32_t j = shape.neighbours()[k];
      b.noalias() += shape.weights()[k] * (x.row(i) - x.row(j)).transpose() * (rest.row(i) - rest.row(j));
    }
    rotations_[place] = fit_rotation(b);
  }

  void move(Points& x, std::int32_t i) const {
    const RestShape& shape = problem_.shape();
    const Points& rest = shape.scaled_positions();
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    double weights = 0;
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      const std::int32_t j = shape.neighbours()[k];
      const Eigen::Matrix3d turn = 0.5 * (rotations_[place_[i]] + rotations_[place_[j]]);
      sum += shape.weights()[k] * (x.row(j) + (rest.row(i) - rest.row(j)) * turn.transpose());
      weights += shape.weights()[k];
    }
    if (weights > 0) x.row(i) = sum / weights;
  }

  const Problem& problem_;
  std::vector<std::int32_t> vertices_;      // the patch, then the ring around it
  std::vector<std::int32_t> place_;         // of each vertex of the mesh in vertices_; -1 if it is not there
  std::vector<std::int32_t> moves_;         // the free vertices of the patch
  std::vector<Eigen::Matrix3d> rotations_;  // of the cells of vertices_
};

/// The cells with the largest terms, if few of them have most of their sum `all`; else none.
std::vector<std::int32_t> kinked_cells(const Problem& problem, double all) {
  const double count = problem.shape().cell_count();
  const auto few = static_cast<std::ptrdiff_t>(kFew * count);
  const auto eased = static_cast<std::ptrdiff_t>(kEased * count);
  if (few == 0) return {};
  const std::vector<double> terms = terms_of(problem);
  std::vector<double> largest = terms;
  std::nth_element(largest.begin(), largest.begin() + eased, largest.end(), std::greater<>());
  const double least = largest[static_cast<std::size_t>(eased)];
  std::nth_element(largest.begin(), largest.begin() + few, largest.begin() + eased, std::greater<>());
  double of_few = 0;
  for (std::ptrdiff_t k = 0; k < few; ++k) of_few += largest[static_cast<std::size_t>(k)];
  if (!(of_few > kMuch * all)) return {};
  std::vector<std::int32_t> cells;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    if (terms[i] > least) cells.push_back(static_cast<std::int32_t>(i));
  }
  return cells;
}

/// The diagonal of the metric of the objective's last evaluation. Off-diagonal entries of soft terms are added with their absolute
/// values, so that a sweep does not overshoot.
std::vector<double> metric_diagonal(const Problem& problem) {
  const RestShape& shape = problem.shape();
  const std::vector<double>& c = problem.objective.cells().cell_weights();
  std::vector<double> diagonal(c.size());
  problem.workers().for_chunks(c.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      double sum = 0;
      for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k)
        sum += shape.weights()[k] * (c[i] + c[shape.neighbours()[k]]);
      diagonal[i] = 2 * sum;
    }
  });
  for (const MatrixEntry& entry :
       problem.objective.soft_terms().matrix_entries(problem.objective.soft_weights())) {
    diagonal[entry.row] += std::abs(entry.value);
    if (entry.column != entry.row) diagonal[entry.column] += std::abs(entry.value);
  }
  return diagonal;
}

}  // namespace

void relax(const Problem& problem, const LpNorm& norm, int sweeps, Points& x) {
  Points step;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    if (sweep == 0)
      problem.objective.reweigh(norm);
    else
      problem.objective.evaluate(x, norm);
    problem.objective.gradient(step);
    restrict_to_free(problem.constraints, step);  // without what holds points and locks
    const std::vector<double> diagonal = metric_diagonal(problem);
    problem.workers().for_chunks(diagonal.size(), kChunk,
                                 [&](std::size_t, std::size_t begin, std::size_t end) {
                                   for (std::size_t i = begin; i < end; ++i) {
                                     const auto row = static_cast<Eigen::Index>(i);
                                     step.row(row) *= diagonal[i] > 0 ? kDamping / diagonal[i] : 0;
                                   }
                                 });
    restrict_to_free(problem.constraints, step);
    x -= step;
  }
}

bool ease_kinks(const Problem& problem, Points& x) {
  const bool can_ease = problem.norm.highest_p() > 2 && problem.constraints.soft.empty() &&
                        problem.constraints.linear.empty() && problem.objective.cells().bends_as_cells();
  if (!can_ease) return false;
  const double before = problem.objective.sum(problem.norm);
  std::vector<std::int32_t> cells = kinked_cells(problem, before);
  if (cells.empty()) return false;
  Patch patch(problem, std::move(cells));
  if (patch.moves().empty()) return false;
  Points rows(static_cast<Eigen::Index>(patch.moves().size()), 3);
  for (Eigen::Index k = 0; k < rows.rows(); ++k)
    rows.row(k) = x.row(patch.moves()[static_cast<std::size_t>(k)]);
  for (int sweep = 0; sweep < kSweeps && !problem.stop.stop_requested(); ++sweep) patch.sweep(x);
  if (problem.objective.evaluate(x, problem.norm) < before) return true;
  for (Eigen::Index k = 0; k < rows.rows(); ++k)
    x.row(patch.moves()[static_cast<std::size_t>(k)]) = rows.row(k);
  problem.objective.evaluate(x, problem.norm);
  return false;
}

}  // namespace lpdeform
