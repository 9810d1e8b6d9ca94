#include "core/gltf/alone.h"

#include <algorithm>
#include <numeric>

namespace lpdeform::gltf {

std::vector<bool> alone(const std::vector<Layout>& layouts,
                        const std::function<bool(const Layout&, const Layout&)>& share_bytes) {
  std::vector<std::size_t> order(layouts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t k) { return layouts[k].begin; });
  std::vector<bool> result(layouts.size(), true);
  std::uint64_t crowded_until = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    const Layout& first = layouts[order[i]];
    if (first.begin < crowded_until) result[order[i]] = false;
    for (std::size_t j = i + 1; j < order.size() && layouts[order[j]].begin < first.end(); ++j) {
      if (j - i > kMostBetween) {
        result[order[i]] = false;
        crowded_until = std::max(crowded_until, first.end());
        break;
      }
      if (share_bytes(first, layouts[order[j]])) result[order[i]] = result[order[j]] = false;
    }
  }
  return result;
}

bool share_bytes(const Layout& a, const Layout& b) {
  if (a.buffer != b.buffer || !(a.begin < b.end() && b.begin < a.end())) return false;
  if (a.stride != b.stride) return true;
  const std::uint64_t gap = (b.begin + a.stride - a.begin % a.stride) % a.stride;
  return gap < a.size || gap + b.size > a.stride;
}

}  // namespace lpdeform::gltf
