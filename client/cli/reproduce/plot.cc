#include "client/cli/reproduce/plot.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/reproduce/markup.h"
#include "core/base/check.h"

namespace lpdeform::reproduce {
namespace {

constexpr double kWidth = 420, kHeight = 290;
constexpr double kLeft = 62, kRight = 408, kTop = 34, kBottom = 244;

/// Maps values to pixels between two places.
struct Scale {
  double low, high, from, to;
  bool is_log = false;

  double operator()(double value) const {
    const double share = is_log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return from + share * (to - from);
  }
  std::vector<double> ticks() const { return is_log ? decade_ticks(low, high) : even_ticks(low, high); }
};

std::string text_at(double x, double y, std::string_view anchor, std::string_view style,
                    std::string_view text) {
  return absl::StrFormat("<text x=\"%.1f\" y=\"%.1f\" text-anchor=\"%s\" class=\"%s\">%s</text>\n", x, y,
                         anchor.data(), style.data(), escaped(text));
}

std::string line_at(double x1, double y1, double x2, double y2, std::string_view style) {
  return absl::StrFormat("<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" class=\"%s\"/>\n", x1, y1, x2,
                         y2, style.data());
}

std::string begin_svg(const std::string& title) {
  return absl::StrFormat(
             "<svg viewBox=\"0 0 %.0f %.0f\" role=\"img\" aria-label=\"%s\" "
             "xmlns=\"http://www.w3.org/2000/svg\">\n",
             kWidth, kHeight, escaped(title)) +
         text_at((kLeft + kRight) / 2, 18, "middle", "title", title);
}

std::string axes(const Scale& x, const Scale& y, const std::string& x_label, const std::string& y_label) {
  std::string svg;
  for (const double tick : x.ticks()) {
    absl::StrAppend(&svg, line_at(x(tick), kBottom, x(tick), kBottom + 5, "axis"),
                    text_at(x(tick), kBottom + 18, "middle", "tick", absl::StrFormat("%g", tick)));
  }
  for (const double tick : y.ticks()) {
    absl::StrAppend(&svg, line_at(kLeft, y(tick), kRight, y(tick), "grid"),
                    text_at(kLeft - 7, y(tick) + 4, "end", "tick", absl::StrFormat("%g", tick)));
  }
  absl::StrAppend(&svg, line_at(kLeft, kBottom, kRight, kBottom, "axis"),
                  line_at(kLeft, kTop, kLeft, kBottom, "axis"),
                  text_at((kLeft + kRight) / 2, kBottom + 37, "middle", "label", x_label));
  absl::StrAppendFormat(
      &svg,
      "<text transform=\"translate(14 %.1f) rotate(-90)\" text-anchor=\"middle\" class=\"label\">%s</text>\n",
      (kTop + kBottom) / 2, escaped(y_label));
  return svg;
}

std::string legend(const std::vector<Series>& series) {
  std::string svg;
  for (std::size_t k = 0; k < series.size(); ++k) {
    const double y = kTop + 12 + 17 * static_cast<double>(k);
    absl::StrAppend(&svg,
                    line_at(kRight - 118, y, kRight - 92, y, absl::StrCat("line line_", series[k].style)),
                    text_at(kRight - 86, y + 4, "start", "tick", series[k].name));
  }
  return svg;
}

std::string polyline(const Series& series, const Scale& x, const Scale& y) {
  std::string svg = absl::StrCat("<polyline class=\"line line_", series.style, "\" points=\"");
  for (const auto& [at_x, at_y] : series.points) absl::StrAppendFormat(&svg, "%.1f,%.1f ", x(at_x), y(at_y));
  return svg + "\"/>\n";
}

/// The lowest and highest value of a coordinate over all series, kept apart by at least a little.
std::array<double, 2> range_of(const std::vector<Series>& series, int coordinate) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const Series& line : series) {
    for (const auto& point : line.points) {
      low = std::min(low, point[coordinate]);
      high = std::max(high, point[coordinate]);
    }
  }
  LPDEFORM_CHECK(low <= high);
  return {low, std::max(high, low + 1e-9 * std::max(1.0, std::abs(low)))};
}

}  // namespace

std::vector<double> even_ticks(double low, double high) {
  const double rough = (high - low) / 5, power = std::pow(10, std::floor(std::log10(rough)));
  const double step = power * (rough < 1.5 * power   ? 1
                               : rough < 3.5 * power ? 2
                               : rough < 7.5 * power ? 5
                                                     : 10);
  std::vector<double> ticks;
  // Adding 0 turns -0 into 0.
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k)
    ticks.push_back(k * step + 0.0);
  return ticks;
}

std::vector<double> decade_ticks(double low, double high) {
  std::vector<double> ticks;
  for (double k = std::ceil(std::log10(low) - 1e-9); k <= std::log10(high) + 1e-9; ++k)
    ticks.push_back(std::pow(10, k));
  return ticks;
}

std::string line_plot(const LinePlot& plot) {
  const auto [x_low, x_high] = range_of(plot.series, 0);
  const auto [y_low, y_high] = range_of(plot.series, 1);
  const double room = 0.06 * (y_high - y_low);
  const Scale x{x_low, x_high, kLeft, kRight, true}, y{y_low - room, y_high + room, kBottom, kTop};
  std::string svg = begin_svg(plot.title) + axes(x, y, plot.x_label, plot.y_label);
  for (const Series& series : plot.series) svg += polyline(series, x, y);
  return svg + legend(plot.series) + "</svg>\n";
}

std::string bar_plot(const BarPlot& plot) {
  const double tallest = std::max<double>(1, static_cast<double>(std::ranges::max(plot.counts)));
  const Scale x{0, plot.highest, kLeft, kRight}, y{0, 1.05 * tallest, kBottom, kTop};
  std::string svg = begin_svg(plot.title) + axes(x, y, plot.x_label, plot.y_label);
  const double width = (kRight - kLeft) / static_cast<double>(plot.counts.size());
  for (std::size_t k = 0; k < plot.counts.size(); ++k) {
    const double top = y(static_cast<double>(plot.counts[k]));
    absl::StrAppendFormat(&svg,
                          "<rect x=\"%.2f\" y=\"%.2f\" width=\"%.2f\" height=\"%.2f\" class=\"bar\"/>\n",
                          kLeft + width * static_cast<double>(k), top, 0.9 * width, kBottom - top);
  }
  return svg + "</svg>\n";
}

}  // namespace lpdeform::reproduce
