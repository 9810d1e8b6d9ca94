#include "core/solve/summary.h"

#include <algorithm>
#include <numeric>

#include "core/base/check.h"

namespace lpdeform {

DistortionStatistics distortion_statistics(const Field& cell_energies, int bins) {
  LPDEFORM_CHECK(bins >= 1);
  DistortionStatistics result;
  std::vector<double> sorted(cell_energies.begin(), cell_energies.end());
  if (sorted.empty()) return result;
  std::sort(sorted.begin(), sorted.end());
  const std::size_t n = sorted.size(), top = (n + 19) / 20;
  const double total = std::accumulate(sorted.begin(), sorted.end(), 0.0);
  result.min = sorted.front();
  result.max = sorted.back();
  result.mean = total / static_cast<double>(n);
  result.median = n % 2 == 1 ? sorted[n / 2] : 0.5 * (sorted[n / 2 - 1] + sorted[n / 2]);
  result.top_5_percent_share = total > 0 ? std::accumulate(sorted.end() - top, sorted.end(), 0.0) / total : 0;

  for (int k = 0; k <= bins; ++k) result.edges.push_back(result.max * k / bins);
  result.counts.assign(bins, 0);
  for (const double energy : sorted) {
    const int bin = result.max > 0 ? static_cast<int>(energy / result.max * bins) : 0;
    ++result.counts[std::min(bin, bins - 1)];
  }
  return result;
}

}  // namespace lpdeform
