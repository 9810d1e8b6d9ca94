#include "core/energy/cell_blocks.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "core/base/check.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLanes = CellBlocks::kLanes;

/// Vertices chunk by chunk, sorted by valence within each chunk. Each chunk is padded with -1 to whole blocks.
std::vector<std::int32_t> cells_by_valence(const RestShape& shape, std::size_t chunk,
                                           const Workers& workers) {
  const auto n = static_cast<std::size_t>(shape.vertex_count());
  const auto valence = [&](std::int32_t i) { return shape.offsets()[i + 1] - shape.offsets()[i]; };
  std::vector<std::int32_t> cells(n);
  std::iota(cells.begin(), cells.end(), 0);
  workers.for_chunks(n, chunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    const auto first = cells.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto last = cells.begin() + static_cast<std::ptrdiff_t>(end);
    std::stable_sort(first, last, [&](std::int32_t a, std::int32_t b) { return valence(a) < valence(b); });
  });
  cells.resize((n + kLanes - 1) / kLanes * kLanes, -1);
  return cells;
}

}  // namespace

CellBlocks::CellBlocks(const RestShape& shape, std::size_t chunk, const Workers& workers)
    : rest(shape.scaled_positions().data()), cells(cells_by_valence(shape, chunk, workers)) {
  LPDEFORM_CHECK(chunk % kLanes == 0);
  const auto& offsets = shape.offsets();
  first_slot.push_back(0);
  for (std::size_t c = 0; c < cells.size(); c += kLanes) {
    std::int32_t slots = 0;
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      const std::int32_t i = cells[c + lane];
      if (i >= 0) slots = std::max(slots, offsets[i + 1] - offsets[i]);
    }
    first_slot.push_back(first_slot.back() + static_cast<std::uint32_t>(slots));
    most_slots = std::max(most_slots, static_cast<std::size_t>(slots));
  }

  LPDEFORM_CHECK(slot_count() * kLanes <= std::numeric_limits<std::uint32_t>::max());

  rest_size.resize(cells.size());
  neighbour.resize(slot_count() * kLanes);
  weight.resize(slot_count() * kLanes);
  opposite.resize(slot_count() * kLanes);
  std::vector<std::uint32_t> place_of_entry(shape.neighbours().size());  // of directed edges in `opposite`
  workers.for_chunks(cells.size(), chunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) fill(shape, c, place_of_entry);
  });
  const auto n = static_cast<std::size_t>(shape.vertex_count());
  workers.for_chunks(n, chunk, [&](std::size_t, std::size_t first, std::size_t last) {
    for (auto i = static_cast<std::int32_t>(first); i < static_cast<std::int32_t>(last); ++i) {
      for (std::int32_t k = offsets[i]; k < offsets[i + 1]; ++k) {
        const std::int32_t j = shape.neighbours()[k];
        const auto ring = shape.neighbours().begin();
        const auto back = std::lower_bound(ring + offsets[j], ring + offsets[j + 1], i) - ring;
        opposite[place_of_entry[k]] = place_of_entry[back];
      }
    }
  });
}

/// Fills the lane of one cell, all but `opposite`, which follows from `place_of_entry` of all cells.
void CellBlocks::fill(const RestShape& shape, std::size_t c, std::vector<std::uint32_t>& place_of_entry) {
  const std::size_t lane = c % kLanes, block = c / kLanes;
  const std::int32_t i = cells[c];
  const std::int32_t begin = i < 0 ? 0 : shape.offsets()[i], end = i < 0 ? 0 : shape.offsets()[i + 1];
  for (std::size_t slot = first_slot[block]; slot < first_slot[block + 1]; ++slot) {
    const std::size_t at = slot * kLanes + lane;
    const auto k = begin + static_cast<std::int32_t>(slot - first_slot[block]);
    const bool is_there = k < end;
    const std::int32_t j = is_there ? shape.neighbours()[k] : std::max(i, 0);
    neighbour[at] = j;
    opposite[at] = static_cast<std::uint32_t>(at);  // itself; corrected below if the slot is in use
    if (!is_there) continue;
    place_of_entry[k] = opposite[at];
    weight[at] = shape.weights()[k];
    const Eigen::RowVector3d edge = shape.scaled_positions().row(i) - shape.scaled_positions().row(j);
    rest_size[c] += weight[at] * edge.squaredNorm();
  }
}

std::size_t CellBlocks::memory_bytes() const {
  return (first_slot.capacity() + cells.capacity() + neighbour.capacity() + opposite.capacity()) *
             sizeof(std::int32_t) +
         (rest_size.capacity() + weight.capacity()) * sizeof(double);
}

}  // namespace lpdeform
