#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "client/cli/files/json_values.h"
#include "client/cpp/types.h"

namespace lpdeform::cli {

/// The keys that say how a handle is held, in the order of client::Hold: "soft", "orientation", ... Exactly has none.
std::vector<const char*> hold_keys();

/// How a handle is held: one of hold_keys() at most, and `footprint`. Throws a Refusal:
/// HANDLE_HOLD_TWICE, HANDLE_WEIGHT_OUT_OF_RANGE, HANDLE_LOCK_DIRECTION, HANDLE_FOOTPRINT_OUT_OF_RANGE.
void read_hold(const json& object, const std::string& owner, client::Handle& handle);

/// The keys that read_hold reads back.
void write_hold(const client::Handle& handle, nlohmann::ordered_json& object);

}  // namespace lpdeform::cli
