#pragma once

#include "core/methods/minimiser.h"

namespace lpdeform {

/// Eases the kinks of a guess at large p, where a few cells with large E_i outweigh the rest of the surface. If a thousandth of the
/// cells has more than half of the objective, makes a few sweeps of local/global iterations around the cells of the largest terms: fits
/// the rotations there, then moves one free vertex after another to where its own edges fit best (Gauss-Seidel on the matrix of
/// Sorkine & Alexa 2007, Eq. 8, i.e. at p = 2). Keeps the result where it lowers the objective.
///
/// problem.objective holds the evaluation of problem.norm at x, before and afterwards. Does nothing where there are soft or linear
/// constraints, or where cells do not bend as in Eq. 2 (CellPass::set_bending). True if x has changed. The same bits on any number of
/// threads. Takes about two evaluations.
bool ease_kinks(const Problem& problem, Points& x);

}  // namespace lpdeform
