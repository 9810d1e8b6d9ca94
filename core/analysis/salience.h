#pragma once

#include "core/analysis/bending.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How much each place would lose its shape if it were stretched along the given directions.
///
///   B           = S_rho[bending measure with absolute angles],  rho as in core/analysis/joints.h
///   theta_i     = 2 rho sum_k w_k u_k^T B_i u_k       how far the surface turns along the u_k within 2 rho
///   salience_i  = 1 - 1 / (1 + (theta_i / 30 degrees)^2),  in [0, 1)
///
/// u_k are unit vectors, the rows of `directions`; w_k >= 0 are their weights. A place that is straight along u keeps
/// its look when it is stretched along u: a flat side, or an edge of a box along its length. Such a place has no
/// salience, however sharp the edge is.
Field salience(const RestShape& shape, const BendingMeasure& smoothed, const Eigen::Matrix3d& directions,
               const Eigen::Vector3d& weights);

/// B above. Zero if the factorisation fails.
BendingMeasure smoothed_bending(const RestShape& shape);

}  // namespace lpdeform
