#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/reproduce/figure.h"
#include "client/cli/reproduce/markup.h"
#include "client/cli/reproduce/statistics.h"

namespace lpdeform::reproduce {
namespace {

constexpr double kZero = 1e-6;  // share of the diagonal

double zero_share(const Experiment& experiment, double p) {
  return share_up_to(experiment.by_p.at(p).energies, kZero * diagonal(experiment.rest()));
}

Claim minimisers_are_sparse(const Measurements& measured) {
  int as_predicted = 0;
  for (const Sparse& problem : measured.sparse) {
    if (problem.non_zeros == problem.rows - problem.rank) ++as_predicted;
  }
  const auto count = static_cast<int>(measured.sparse.size());
  return {
      "With probability 1 the minimiser of |Ax + b|_1 has only m - r_s non-zeros (printed as m - 1 - r_s; "
      "see below).",
      absl::StrCat(as_predicted, " of ", count, " generated problems have exactly m - r_s non-zeros."),
      as_predicted == count,
      {{"as_predicted", as_predicted}, {"problems", count}}};
}

Claim cells_are_sparse(const Measurements& measured) {
  const std::vector<const Experiment*> all = measured.all();
  double one = 0, two = 0;
  std::size_t sparser = 0;
  for (const Experiment* const experiment : all) {
    one += zero_share(*experiment, 1) / static_cast<double>(all.size());
    two += zero_share(*experiment, 2) / static_cast<double>(all.size());
    if (zero_share(*experiment, 1) > zero_share(*experiment, 2)) ++sparser;
  }
  return {"For p = 1 distortion tends to a sparse set of cells.",
          absl::StrFormat(
              "L1 has more cells below 1e-6 of the diagonal than L2 on %d of %d shapes (in the mean over all "
              "of them L1 %s, L2 %s).",
              sparser, all.size(), percent_text(one), percent_text(two)),
          sparser == all.size(),
          {{"sparser_shapes", static_cast<double>(sparser)},
           {"shapes", static_cast<double>(all.size())},
           {"zero_share_p1", one},
           {"zero_share_p2", two}}};
}

std::string problem_table(const Measurements& measured) {
  std::vector<std::vector<std::string>> rows;
  for (const Sparse& problem : measured.sparse) {
    rows.push_back({absl::StrCat(problem.rows, " x ", problem.columns), absl::StrCat(problem.rank),
                    absl::StrCat(problem.rows - problem.rank), absl::StrCat(problem.non_zeros),
                    absl::StrCat(problem.non_zeros_least_squares),
                    absl::StrFormat("%.1e", std::max(0.0, problem.gap))});
  }
  return html_table(
      {"A: m x n", "rank r_s", "m - r_s", "non-zeros, L1", "non-zeros, L2", "duality gap of L1"}, rows);
}

std::string cell_table(const Measurements& measured) {
  std::vector<std::vector<std::string>> rows;
  for (const Experiment* const experiment : measured.all()) {
    rows.push_back({experiment->pose.name});
    for (const auto& [p, solve] : experiment->by_p)
      rows.back().push_back(percent_text(zero_share(*experiment, p)));
  }
  return html_table({"cells below 1e-6 of the diagonal", "p = 1", "p = 1.5", "p = 2", "p = 6"}, rows);
}

}  // namespace

Figure appendix(const Measurements& measured) {
  return {
      "appendix",
      "Appendix: sparsity",
      "Random A and b, and the cells of all shapes above.",
      {minimisers_are_sparse(measured), cells_are_sparse(measured)},
      problem_table(measured) + cell_table(measured),
      {},
      "The appendix prints m - 1 - r_s. But for almost every b, u = s + b with s from a space of dimension "
      "r_s can vanish in r_s places and not in more, so the count is m - r_s. The appendix is about scalar "
      "residuals. A cell of the energy has three residuals for each of its edges and vanishes only if all of "
      "them do. So a shape becomes sparse if it can move in rigid pieces (creature), and not at all if "
      "everything has to bend (bar). Held cells are among the zeros for every p. The claim holds only if L1 "
      "has more zeros on every shape, because one very sparse shape could dominate a mean."};
}

}  // namespace lpdeform::reproduce
