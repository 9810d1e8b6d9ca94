#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/reproduce/figure.h"
#include "client/cli/reproduce/markup.h"

namespace lpdeform::reproduce {
namespace {

constexpr double kColumns[] = {1, 2, 1.5, 6};  // p in the order of the paper's table

/// A row of the paper's Table 1; 0 if the paper has no entry.
struct PaperRow {
  const char* shape;
  const char* name;  // the paper's
  int vertices, faces;
  struct Cell {
    int iterations;
    double seconds;
  } cells[4];
};
constexpr PaperRow kPaper[] = {
    {"sheet", "Sheet", 3962, 7920, {{19, 187.141}, {50, 28.002}, {1496, 658.848}, {32, 15.974}}},
    {"bar", "Bar", 370, 736, {{6, 3.770}, {9, 1.133}, {92, 5.739}, {12, 0.760}}},
    {"block", "Block", 2132, 4272, {{21, 144.153}, {17, 6.109}, {0, 0}, {0, 0}}},
    {"creature", "Dinopet", 2251, 4498, {{3, 15.539}, {2, 2.005}, {0, 0}, {0, 0}}},
    {"arm", "Rocker arm", 2108, 4216, {{3, 18.454}, {3, 2.000}, {0, 0}, {0, 0}}}};

std::vector<std::string> row_here(const Experiment& experiment) {
  std::vector<std::string> row{absl::StrCat(experiment.pose.name, ", here"),
                               absl::StrCat(experiment.rest().rows()),
                               absl::StrCat(experiment.shape->faces().rows())};
  for (const double p : kColumns) {
    const Solve& solve = experiment.by_p.at(p);
    const bool is_done = solve.summary.stop_reason == StopReason::kConverged;
    const char* const mark = solve.summary.method == Method::kMultiresolution ? " †" : "";
    row.push_back(absl::StrCat(solve.summary.iterations, mark, is_done ? "" : " *"));
    row.push_back(absl::StrFormat("%.3f", solve.seconds));
  }
  return row;
}

std::vector<std::string> row_of_paper(const PaperRow& paper) {
  std::vector<std::string> row{absl::StrCat(paper.name, ", paper"), absl::StrCat(paper.vertices),
                               absl::StrCat(paper.faces)};
  for (const PaperRow::Cell& cell : paper.cells) {
    row.push_back(cell.iterations > 0 ? absl::StrCat(cell.iterations) : "–");
    row.push_back(cell.iterations > 0 ? absl::StrFormat("%.3f", cell.seconds) : "–");
  }
  return row;
}

std::string table(const Measurements& measured) {
  std::vector<std::vector<std::string>> rows;
  for (const Experiment* const experiment : measured.all()) {
    rows.push_back(row_here(*experiment));
    for (const PaperRow& paper : kPaper) {
      if (paper.shape == experiment->pose.name) rows.push_back(row_of_paper(paper));
    }
  }
  return html_table(
      {"", "N_V", "N_F", "N_1", "T_1 (s)", "N_2", "T_2 (s)", "N_1.5", "T_1.5 (s)", "N_6", "T_6 (s)"}, rows);
}

Claim every_solve_converges(const Measurements& measured) {
  int solves = 0, converged = 0;
  Claim claim{"Each of these deformations is solved to convergence.", "", false, {}};
  for (const Experiment* const experiment : measured.all()) {
    for (const auto& [p, solve] : experiment->by_p) {
      ++solves;
      if (solve.summary.stop_reason == StopReason::kConverged) ++converged;
      const std::string key = absl::StrCat(experiment->pose.name, "_p", p);
      claim.numbers.emplace_back(absl::StrCat(key, "_iterations"), solve.summary.iterations);
      claim.numbers.emplace_back(absl::StrCat(key, "_seconds"), solve.seconds);
    }
  }
  claim.measured = absl::StrCat(converged, " of ", solves, " solves met their tolerance.");
  claim.holds = converged == solves;
  return claim;
}

Claim six_is_faster_than_two(const Measurements& measured) {
  const double six = measured.sheet.by_p.at(6).seconds, two = measured.sheet.by_p.at(2).seconds;
  return {"For the sheet, the L6 norm takes less time than the L2 norm (15.974 s against 28.002 s).",
          absl::StrFormat("L6 %.3f s, L2 %.3f s: %.2f times as long.", six, two, six / two),
          six < two,
          {{"seconds_p6_over_p2", six / two}}};
}

/// The geometric mean of the paper's seconds over the measured ones, where the paper has an entry.
double mean_ratio(const Measurements& measured) {
  double sum = 0, count = 0;
  for (const Experiment* const experiment : measured.all()) {
    for (const PaperRow& paper : kPaper) {
      if (paper.shape != experiment->pose.name) continue;
      for (int k = 0; k < 4; ++k) {
        if (paper.cells[k].iterations == 0) continue;
        sum += std::log(paper.cells[k].seconds / std::max(1e-9, experiment->by_p.at(kColumns[k]).seconds));
        ++count;
      }
    }
  }
  return std::exp(sum / count);
}

bool uses(const Measurements& measured, Method method) {
  return std::ranges::any_of(measured.all(), [&](const Experiment* experiment) {
    return std::ranges::any_of(experiment->by_p,
                               [&](const auto& entry) { return entry.second.summary.method == method; });
  });
}

/// Whether the sheet and the bar have the numbers of vertices that the paper gives.
bool has_papers_sizes(const Measurements& measured) {
  return measured.sheet.rest().rows() == kPaper[0].vertices &&
         measured.bar.rest().rows() == kPaper[1].vertices;
}

std::string shapes_text(const Measurements& measured) {
  return absl::StrCat(
      measured.others.empty() ? "All shapes are generated; " : "The paper's shapes are generated; ",
      has_papers_sizes(measured)
          ? "the sheet and the bar have the same numbers of vertices and faces as in the paper. The others "
            "are shapes of the same kind with about as many vertices."
          : absl::StrCat("they are of the same kinds as in the paper, but with ",
                         number_text(measured.sheet.size),
                         " times as many cells along each side, so their numbers of vertices differ."),
      measured.others.empty() ? "" : " The others were added by --mesh.");
}

std::string methods_text(const Measurements& measured) {
  return absl::StrCat(
      "Method: quasi_newton",
      uses(measured, Method::kMultiresolution) ? ", and multiresolution for numbers with a †; it is chosen "
                                                 "for large meshes, and its iterations are "
                                                 "counted on the fine level"
                                               : " for every p",
      ". At p = 1 both are tried, the better result is kept, and the iterations of both are counted. ",
      absl::StrFormat(
          "Solves start from the naive Laplacian guess, with a relative tolerance of 1e-5 and %d thread%s. "
          "Seconds include set-up and solve and are the median of up to five runs. A * marks solves that "
          "ended short of the tolerance. ",
          measured.threads, measured.threads == 1 ? "" : "s"));
}

std::string times_text(const Measurements& measured) {
  if (!has_papers_sizes(measured))
    return "The paper's times are for its own numbers of vertices and cannot be compared with these. ";
  return absl::StrFormat(
      "In the geometric mean of all entries the paper's times are %.0f times as long. Its machine was "
      "different (two quad-core 2.27 GHz CPUs of 2011, one core used), and so were its methods: cone "
      "programs for L1, the local-global alternation for L2, and line search otherwise. ",
      mean_ratio(measured));
}

}  // namespace

Figure table_1(const Measurements& measured) {
  const double six = measured.trace(6, Method::kLineSearch).summary.solve_seconds;
  const double two = measured.trace(2, Method::kLocalGlobal).summary.solve_seconds;
  return {"table_1",
          "Table 1: iterations and seconds",
          shapes_text(measured),
          {every_solve_converges(measured), six_is_faster_than_two(measured)},
          table(measured),
          {},
          absl::StrCat(
              methods_text(measured), times_text(measured),
              "Whether L6 or L2 is faster depends on the solver: at p = 2 the metric of quasi_newton is the "
              "exact curvature for fixed rotations; at p = 6 the solver must learn it. With the paper's own "
              "methods the bar takes ",
              number_text(six), " s for L6 (line_search) and ", number_text(two),
              " s for L2 (local_global) here.")};
}

}  // namespace lpdeform::reproduce
