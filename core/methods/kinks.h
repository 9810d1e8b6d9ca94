#pragma once

#include "core/methods/minimiser.h"

namespace lpdeform {

/// Eases the kinks of a guess at large p, where a few cells with large E_i outweigh the rest of the surface. Does nothing unless a
/// thousandth of the cells has more than half of the objective. Otherwise it makes a few sweeps around the cells of the largest terms. A
/// sweep fits the rotations there, and then moves one free vertex after another to where its own edges fit best. That is a Gauss-Seidel
/// iteration for the system of Sorkine & Alexa 2007, Eq. 8, which is for p = 2. The result is kept if it lowers the objective.
///
/// problem.objective holds the evaluation of problem.norm at x, before and afterwards. Does nothing on fewer than 1,000 cells, if there are
/// soft or linear constraints, or if cells do not bend as in Eq. 2 (CellPass::set_bending). True if x has changed. The same bits on any
/// number of threads. Takes as long as one or two evaluations, and where the largest cells are scattered as long as about eight.
/// problem.stop ends the sweeps.
bool ease_kinks(const Problem& problem, Points& x);

/// Evens a guess out by damped Jacobi sweeps:
///
///   x -= w P D^-1 P g
///
/// g is the gradient of `norm` at x, soft terms included, and P the projection on what the constraints allow. D is the diagonal of the
/// metric of `norm` (Metric), plus the absolute values of what soft terms have off the diagonal. w is 2/3. Unlike a step in the metric, a
/// sweep needs no factor, and takes away mainly what varies from one vertex to the next. It may raise the objective.
///
/// problem.objective holds an evaluation at x when it is called; afterwards its evaluation is of another state. The constraints stay
/// satisfied. problem.stop does not end it. The same bits on any number of threads.
void relax(const Problem& problem, const LpNorm& norm, int sweeps, Points& x);

}  // namespace lpdeform
