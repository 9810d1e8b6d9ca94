#include "client/cli/reproduce/plot.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "client/cli/reproduce/markup.h"

namespace lpdeform::reproduce {
namespace {

using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pointwise;

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

TEST(Ticks, AreRoundNumbersWithinTheRange) {
  EXPECT_THAT(even_ticks(0, 100), ElementsAre(0, 20, 40, 60, 80, 100));
  EXPECT_THAT(even_ticks(0.13, 0.41), Pointwise(DoubleNear(1e-12), {0.15, 0.2, 0.25, 0.3, 0.35, 0.4}));
  EXPECT_THAT(even_ticks(-3, 3), ElementsAre(-3, -2, -1, 0, 1, 2, 3));
}

TEST(Ticks, OfALogarithmicAxisArePowersOfTen) {
  EXPECT_THAT(decade_ticks(1, 20000), ElementsAre(1, 10, 100, 1000, 10000));
  EXPECT_THAT(decade_ticks(0.05, 0.5), Pointwise(DoubleNear(1e-15), {0.1}));
}

TEST(Ticks, WriteNoNegativeZero) {
  EXPECT_FALSE(std::signbit(even_ticks(0, 1).front()));
}

TEST(LinePlot, HasALineAndALegendEntryForEachSeries) {
  const std::string svg =
      line_plot({"a < b", "x", "y", {{"one", {{1, 3}, {10, 2}}}, {"two", {{1, 3}, {100, 1}}}}});
  EXPECT_EQ(count(svg, "<polyline"), 2);
  EXPECT_THAT(svg, HasSubstr(">one</text>"));
  EXPECT_THAT(svg, HasSubstr(">two</text>"));
  EXPECT_THAT(svg, HasSubstr("a &lt; b"));
}

TEST(LinePlot, DrawsASeriesAndItsLegendEntryInItsOwnStyle) {
  const std::string svg = line_plot({"", "", "", {{"", {{1, 5}, {2, 4}}, 2}, {"", {{1, 3}, {2, 4}}, 0}}});
  EXPECT_EQ(count(svg, "line_2\""), 2);
  EXPECT_EQ(count(svg, "line_0\""), 2);
  EXPECT_EQ(count(svg, "line_1\""), 0);
}

TEST(LinePlot, PutsTheEndsOfItsRangesOntoTheAxesEnds) {
  const std::string svg = line_plot({"", "", "", {{"", {{1, 0}, {10, 1}, {100, 0}}}}});
  // Logarithmic: 10 lies half-way between 1 and 100.
  EXPECT_THAT(svg, HasSubstr("points=\"62.0,"));
  EXPECT_THAT(svg, HasSubstr(" 235.0,"));
  EXPECT_THAT(svg, HasSubstr(" 408.0,"));
}

TEST(LinePlot, DrawsASinglePoint) {
  EXPECT_EQ(count(line_plot({"", "", "", {{"", {{1, 5}}}}}), "nan"), 0);
}

TEST(BarPlot, HasABarForEachCountAndNoneTallerThanThePlot) {
  const std::string svg = bar_plot({"", "", "", 2.5, {0, 7, 3}});
  EXPECT_EQ(count(svg, "<rect"), 3);
  EXPECT_THAT(svg, HasSubstr("height=\"0.00\""));
  EXPECT_THAT(svg, HasSubstr("height=\"200.00\""));  // 7 of 1.05 * 7, 210 pixels high
}

TEST(Markup, EscapesWhatHtmlWouldTakeForItsOwn) {
  EXPECT_EQ(escaped("a<b & \"c\">"), "a&lt;b &amp; &quot;c&quot;&gt;");
}

TEST(Markup, WritesNumbersAsPeopleDo) {
  EXPECT_EQ(number_text(0.08312), "0.0831");
  EXPECT_EQ(number_text(1024.4), "1024");
  EXPECT_EQ(percent_text(0.1234), "12.3 %");
}

}  // namespace
}  // namespace lpdeform::reproduce
