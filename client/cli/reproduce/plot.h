#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lpdeform::reproduce {

/// Plots as SVG elements to stand inside an HTML page, whose style gives their classes colours (line_0, line_1,
/// ..., axis, grid, bar) so that they can be read on light and dark.

struct Series {
  std::string name;
  std::vector<std::array<double, 2>> points;  // x ascending, finite
  int style = 0;                              // 0 to 3: colour and dash, the class line_0 to line_3
};

struct LinePlot {
  std::string title, x_label, y_label;
  std::vector<Series> series;  // at least one point in all; at most 4
};
/// x on a logarithmic scale (all x > 0), y on a linear one.
std::string line_plot(const LinePlot& plot);

struct BarPlot {
  std::string title, x_label, y_label;
  double highest = 1;                // the bars share [0, highest] evenly; > 0
  std::vector<std::int64_t> counts;  // at least one
};
std::string bar_plot(const BarPlot& plot);

/// Values that axes are marked at, within [low, high], low < high: multiples of 1, 2 or 5 times a power of ten,
/// some five of them.
std::vector<double> even_ticks(double low, double high);
/// Powers of ten within [low, high], 0 < low < high.
std::vector<double> decade_ticks(double low, double high);

}  // namespace lpdeform::reproduce
