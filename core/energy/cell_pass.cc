#include "core/energy/cell_pass.h"

#include <algorithm>
#include <numeric>

namespace lpdeform {
namespace {

constexpr std::size_t kLanes = CellBlocks::kLanes;
constexpr std::size_t kRowChunk = 4096;  // vertices

}  // namespace

CellPass::CellPass(std::shared_ptr<const RestShape> shape, Workers workers)
    : shape_(std::move(shape)),
      workers_(std::move(workers)),
      blocks_(*shape_, kChunk, workers_),
      state_(blocks_),
      rows_(shape_->vertex_count() * kRow, 0.0),
      c_(shape_->vertex_count(), 0.0),
      chunk_sums_((shape_->vertex_count() + kChunk - 1) / kChunk) {}

void CellPass::set_bending(const Field& shares) {
  const bool has_all_faces = membrane_ && bending_.size() == 1;
  bending_ = shares;
  if ((shares.array() >= 1).all()) {
    membrane_.reset();
  } else if (shares.size() > 1) {
    std::vector<char> bends(shares.size());
    for (std::size_t i = 0; i < bends.size(); ++i) bends[i] = bending(i) < 1 ? 1 : 0;
    membrane_.emplace(shape_, workers_, bends);
  } else if (!has_all_faces) {
    membrane_.emplace(shape_, workers_);
  }
  for (std::vector<double>* weights : {&bent_c_, &stretched_c_}) {
    weights->resize(membrane_ ? c_.size() : 0);
    weights->shrink_to_fit();
  }
}

/// Makes the E_i^2 of cells begin to end - 1, as Eq. 2 has them, those of set_bending().
void CellPass::replace_bending(std::size_t begin, std::size_t end) const {
  for (std::size_t i = begin; i < end; ++i) {
    const double share = bending(i);
    if (share >= 1) continue;
    const double stretching = membrane_->share(static_cast<std::int32_t>(i));
    state_.squared[i] = share * state_.squared[i] + (1 - share) * stretching;
  }
}

double CellPass::evaluate(const Points& x, const LpNorm& norm) {
  state_.rotations = {};  // of the x before
  return evaluate_cells(x, norm, true);
}

double CellPass::evaluate_held(const Points& x, const LpNorm& norm) {
  keep_rotations();
  return evaluate_cells(x, norm, false);
}

/// Adds up body(begin, end) over all chunks; body returns the sum over its cells.
template <typename Body>
double CellPass::sum_of_chunks(const Body& body) const {
  workers_.for_chunks(c_.size(), kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    chunk_sums_[chunk] = body(begin, end);
  });
  return std::accumulate(chunk_sums_.begin(), chunk_sums_.end(), 0.0);
}

double CellPass::evaluate_cells(const Points& x, const LpNorm& norm, bool fit) {
  workers_.for_chunks(c_.size(), kRowChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    const double* from = x.data() + 3 * begin;
    for (double* to = rows_.data() + kRow * begin; begin < end; ++begin, to += kRow, from += 3) {
      to[0] = from[0], to[1] = from[1], to[2] = from[2];
    }
  });
  if (membrane_) membrane_->evaluate(rows_.data(), workers_);
  return sum_of_chunks([&](std::size_t begin, std::size_t end) {
    const std::size_t first = begin / kLanes, last = (end + kLanes - 1) / kLanes;
    evaluate_blocks(blocks_, first, last, rows_.data(), fit, state_);
    if (membrane_) replace_bending(begin, end);
    return weigh(norm, begin, end);
  });
}

/// Returns the sum of the terms of cells begin to end - 1 and stores their weights c_i.
double CellPass::weigh(const LpNorm& norm, std::size_t begin, std::size_t end) {
  double sum = 0;
  for (std::size_t i = begin; i < end; ++i) {
    const LpNorm::Term term = norm.term(static_cast<std::int32_t>(i), state_.squared[i]);
    c_[i] = term.weight;
    sum += term.value;
  }
  return sum;
}

double CellPass::reweigh(const LpNorm& norm) {
  return sum_of_chunks([&](std::size_t begin, std::size_t end) { return weigh(norm, begin, end); });
}

double CellPass::sum(const LpNorm& norm) const {
  return sum_of_chunks([&](std::size_t begin, std::size_t end) {
    double sum = 0;
    for (std::size_t i = begin; i < end; ++i)
      sum += norm.term(static_cast<std::int32_t>(i), state_.squared[i]).value;
    return sum;
  });
}

void CellPass::gradient(Points& result) const {
  result.resize(shape_->vertex_count(), 3);
  workers_.for_chunks(bent_c_.size(), kRowChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      bent_c_[i] = bending(i) * c_[i];
      stretched_c_[i] = (1 - bending(i)) * c_[i];
    }
  });
  const std::vector<double>& c = membrane_ ? bent_c_ : c_;
  workers_.for_chunks(c_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    gradient_of_blocks(blocks_, begin / kLanes, (end + kLanes - 1) / kLanes, state_, c.data(), result.data());
  });
  if (membrane_) membrane_->add_gradient(stretched_c_, workers_, result);
}

template <typename Motion>
void CellPass::find_turning_forces(const Motion& motion, const std::vector<double>& c, Points& forces) {
  workers_.for_chunks(c_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    turn_blocks(blocks_, begin / kLanes, (end + kLanes - 1) / kLanes, motion, state_);
  });
  forces.resize(shape_->vertex_count(), 3);
  workers_.for_chunks(c_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    gradient_of_blocks(blocks_, begin / kLanes, (end + kLanes - 1) / kLanes, state_, c.data(), forces.data());
  });
}

void CellPass::turning_forces(const OngoingMotion& motion, const std::vector<double>& c, Points& forces) {
  find_turning_forces(motion, c, forces);
}

void CellPass::turning_forces(const TurnedMotion& motion, const std::vector<double>& c, Points& forces) {
  find_turning_forces(motion, c, forces);
}

/// Most methods need no rotations. The others have the last x evaluated again, which changes nothing else.
void CellPass::keep_rotations() const {
  if (!state_.rotations.empty()) return;
  state_.keep_rotations(blocks_);
  workers_.for_chunks(blocks_.block_count(), kChunk / kLanes,
                      [&](std::size_t, std::size_t begin, std::size_t end) {
                        evaluate_blocks(blocks_, begin, end, rows_.data(), true, state_);
                        if (membrane_) replace_bending(begin * kLanes, std::min(end * kLanes, c_.size()));
                      });
}

std::vector<Eigen::Matrix3d> CellPass::rotations() const {
  keep_rotations();
  std::vector<Eigen::Matrix3d> result(c_.size());
  for (std::size_t k = 0; k < blocks_.cells.size(); ++k) {
    if (blocks_.cells[k] < 0) continue;
    const double* const lane = state_.rotations.data() + k / kLanes * 9 * kLanes + k % kLanes;
    for (std::size_t e = 0; e < 9; ++e) result[blocks_.cells[k]](e / 3, e % 3) = lane[e * kLanes];
  }
  return result;
}

std::size_t CellPass::memory_bytes() const {
  return blocks_.memory_bytes() + state_.memory_bytes() + (membrane_ ? membrane_->memory_bytes() : 0) +
         (rows_.capacity() + c_.capacity() + bent_c_.capacity() + stretched_c_.capacity() + bending_.size() +
          chunk_sums_.capacity()) *
             sizeof(double);
}

}  // namespace lpdeform
