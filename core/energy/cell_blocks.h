#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/workers.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// The one-rings of a shape, laid out for vector instructions. A block holds eight cells, one per lane. Blocks lie
/// within chunks of consecutive vertices. In a chunk the cells are sorted by valence, so that the cells of a block have
/// about the same number of neighbours. A block has as many slots as its largest cell has neighbours; a slot holds one
/// neighbour of each of the eight cells. Unused lanes and slots have weight 0 and the cell itself as neighbour, so they
/// add nothing. Immutable. Keeps a pointer to the shape's scaled positions: the shape must outlive it.
struct CellBlocks {
  static constexpr std::size_t kLanes = 8;

  /// `chunk`: a multiple of kLanes.
  CellBlocks(const RestShape& shape, std::size_t chunk, const Workers& workers = Workers(1));

  std::size_t block_count() const { return first_slot.size() - 1; }
  std::size_t slot_count() const { return first_slot.back(); }
  std::size_t memory_bytes() const;

  const double* rest = nullptr;           // x, y and z of each vertex at rest, in scaled units
  std::vector<std::uint32_t> first_slot;  // of each block; the last entry is the end
  std::size_t most_slots = 0;             // the most slots that a block has
  std::vector<std::int32_t> cells;        // [block][lane]: vertex; -1 in lanes without a cell
  std::vector<double> rest_size;          // [block][lane]: sum_j w_ij |p_i - p_j|^2

  std::vector<std::int32_t> neighbour;  // [slot][lane]: vertex; 0 in lanes without a cell
  std::vector<double> weight;           // [slot][lane]: w_ij
  std::vector<std::uint32_t> opposite;  // [slot][lane]: index of the reverse edge, from j to i

 private:
  void fill(const RestShape& shape, std::size_t c, std::vector<std::uint32_t>& place_of_entry);
};

}  // namespace lpdeform
