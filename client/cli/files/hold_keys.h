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

/// How a handle is held: `soft`, `orientation`, `axis_lock` or `plane_lock`, and `footprint`. Throws a Refusal:
/// HANDLE_HOLD_TWICE, HANDLE_WEIGHT_OUT_OF_RANGE, HANDLE_LOCK_DIRECTION, HANDLE_FOOTPRINT_OUT_OF_RANGE.
void read_hold(const json& object, const std::string& owner, client::Handle& handle);

/// The keys that points_of and read_hold read back.
void write_hold(const client::Handle& handle, nlohmann::ordered_json& object);

}  // namespace lpdeform::cli
