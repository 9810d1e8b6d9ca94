#pragma once

#include <string>
#include <utility>
#include <vector>

#include "client/cli/reproduce/measure.h"

namespace lpdeform::reproduce {

/// A statement of the paper, compared with what was measured.
struct Claim {
  std::string text;                                     // the paper's statement, in one sentence
  std::string measured;                                 // the numbers that decide, in words
  bool holds = false;                                   // decided by these numbers alone
  std::vector<std::pair<std::string, double>> numbers;  // the same numbers for programs
};

struct Picture {
  std::string file;  // "bar_p1.png"
  std::string caption;
  std::string png;  // bytes
  int width, height;
};

/// A figure or table of the paper, reproduced.
struct Figure {
  std::string id;     // "figure_3"
  std::string title;  // "Figure 3: a sheet is folded"
  std::string shape;  // the deformed shape, in a sentence
  std::vector<Claim> claims;
  std::string body;               // HTML: tables and SVG plots
  std::vector<Picture> pictures;  // of one size, at most 5
  std::string note;               // what a reader should know besides; may be empty
};

Figure table_1(const Measurements& measured);
Figure figure_1(const Measurements& measured);     // energy by iteration
Figure figure_2(const Measurements& measured);     // histograms of cell energies
Figure figure_3(const Measurements& measured);     // the sheet, folded
Figure figure_4(const Measurements& measured);     // the bar, twisted
Figure figure_5(const Measurements& measured);     // the block, stretched
Figure figure_6(const Measurements& measured);     // the creature, its head moved
Figure figure_7(const Measurements& measured);     // the arm, stretched
Figure figure_8(const Measurements& measured);     // the sheet with two norms
Figure figure_9(const Measurements& measured);     // the block with two norms
Figure section_3_2(const Measurements& measured);  // the global minimum of the convex step
Figure section_5(const Measurements& measured);    // continuous variation with p
Figure appendix(const Measurements& measured);     // sparsity
Figure other_mesh(const Experiment& experiment);

}  // namespace lpdeform::reproduce
