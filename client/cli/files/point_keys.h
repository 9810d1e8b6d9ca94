#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/files/json_values.h"
#include "client/cpp/types.h"

namespace lpdeform::cli {

/// `points` of a handle object: {"face", "barycentric"} each. Throws a Refusal: HANDLE_POINTS_AND_VERTICES,
/// HANDLE_EMPTY, HANDLE_BARYCENTRIC, and what json_values.h has.
std::vector<client::SurfacePoint> points_of(const json& object, const std::string& owner);

/// The key that points_of reads back; none where there are no points.
void write_points(const std::vector<client::SurfacePoint>& points, nlohmann::ordered_json& object);

}  // namespace lpdeform::cli
