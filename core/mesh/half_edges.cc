#include "core/mesh/half_edges.h"

#include <algorithm>

namespace lpdeform {
namespace {

template <typename Visit>
void for_sides(const Faces& faces, const std::function<bool(Eigen::Index)>& takes, const Visit& visit) {
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    if (!takes(f)) continue;
    for (int k = 0; k < 3; ++k) {
      const std::int32_t a = faces(f, k), b = faces(f, (k + 1) % 3);
      if (a != b) visit(std::min(a, b), HalfEdge{std::max(a, b), static_cast<std::int32_t>(3 * f + k)});
    }
  }
}

/// Sorts by (high, id). The ids must be ascending before.
void sort_by_high(std::vector<HalfEdge>& half_edges, std::int32_t first, std::int32_t last) {
  constexpr std::int32_t kFew = 32;
  const auto begin = half_edges.begin() + first, end = half_edges.begin() + last;
  const auto is_less = [](HalfEdge a, HalfEdge b) {
    return a.high != b.high ? a.high < b.high : a.id < b.id;
  };
  if (last - first > kFew) return std::sort(begin, end, is_less);
  for (auto at = begin; at != end; ++at) {
    const HalfEdge moved = *at;
    auto hole = at;
    for (; hole != begin && (hole - 1)->high > moved.high; --hole) *hole = *(hole - 1);
    *hole = moved;
  }
}

}  // namespace

EdgeTable::EdgeTable(std::int64_t vertices, const Faces& faces,
                     const std::function<bool(Eigen::Index)>& takes)
    : start_(vertices + 1, 0) {
  for_sides(faces, takes, [&](std::int32_t low, HalfEdge) { ++start_[low + 1]; });
  std::partial_sum(start_.begin(), start_.end(), start_.begin());
  half_edges_.resize(start_.back());
  std::vector<std::int32_t> next(start_.begin(), start_.end() - 1);
  for_sides(faces, takes,
            [&](std::int32_t low, HalfEdge half_edge) { half_edges_[next[low]++] = half_edge; });
  for (std::int64_t v = 0; v < vertices; ++v) sort_by_high(half_edges_, start_[v], start_[v + 1]);
}

void EdgeTable::for_edges(
    const std::function<void(std::int32_t, std::int32_t, std::span<const HalfEdge>)>& visit) const {
  for (std::size_t v = 0; v + 1 < start_.size(); ++v) {
    const std::span<const HalfEdge> fan(half_edges_.data() + start_[v], half_edges_.data() + start_[v + 1]);
    for (std::size_t begin = 0, end = 0; begin < fan.size(); begin = end) {
      while (end < fan.size() && fan[end].high == fan[begin].high) ++end;
      visit(static_cast<std::int32_t>(v), fan[begin].high, fan.subspan(begin, end - begin));
    }
  }
}

}  // namespace lpdeform
