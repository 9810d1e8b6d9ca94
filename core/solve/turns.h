#pragma once

#include <vector>

#include "core/base/workers.h"
#include "core/constraints/metric.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How the surface has turned around each vertex on the way from the state `before` to the state `now`, times `share`: a rotation
/// matrix. The vector v_i minimises
///
///   sum over j of w_ij |d_j - v_i x m_j|^2,    d_j = e_j' - e_j,  m_j = (e_j + e_j') / 2
///
/// where e_j and e_j' are the edges from i to its neighbours in the two states, and w_ij are the weights. v_i is 2 tan(angle / 2) times
/// the axis if the edges turn rigidly (Cayley). share v_i belongs to share times the angle but for terms of third order. A vertex that
/// has turned by more than 90 degrees counts as one that has not turned, like one whose edges all have length or weight zero; near 180
/// degrees it may get any turn of less than 90 degrees. Edges along one line do not turn about it. The same bits on any number of threads.
std::vector<Turn> turns_between(const RestShape& shape, const Points& before, const Points& now, double share,
                                const Workers& workers);

}  // namespace lpdeform
