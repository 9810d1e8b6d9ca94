#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace lpdeform::reproduce {

/// Plots as SVG elements inside an HTML page. The page's style gives their classes colours (line_0, line_1,
/// ..., axis, grid, bar), so that they are readable on light and dark backgrounds.

struct Series {
  std::string name;
  std::vector<std::array<double, 2>> points;  // x ascending, finite
  int style = 0;                              // 0 to 3: colour and dash, the class line_0 to line_3
};

struct LinePlot {
  std::string title, x_label, y_label;
  std::vector<Series> series;  // at least one point in all; at most 4 series
};
/// x on a logarithmic scale (all x > 0), y on a linear one.
std::string line_plot(const LinePlot& plot);

struct BarPlot {
  std::string title, x_label, y_label;
  double highest = 1;                // the bars divide [0, highest] evenly; > 0
  std::vector<std::int64_t> counts;  // at least one
};
std::string bar_plot(const BarPlot& plot);

/// Values for the marks of an axis, within [low, high], low < high: multiples of 1, 2 or 5 times a power of
/// ten, about five of them.
std::vector<double> even_ticks(double low, double high);
/// Powers of ten within [low, high], 0 < low < high.
std::vector<double> decade_ticks(double low, double high);

}  // namespace lpdeform::reproduce
