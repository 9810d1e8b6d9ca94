#pragma once

#include <array>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/strings/string_view.h"
#include "core/base/reasons.h"

namespace lpdeform::cli {

// Read values out of JSON, with errors that name the place, the key and the value. A function that cannot
// return its value throws a Refusal, so that reading can be an expression. The file's entry point catches it.

using nlohmann::json;

struct Refusal {
  absl::Status status;
};

[[noreturn]] void refuse(Reason reason, std::string element, std::string_view text, std::string limit = "");

/// Throws HANDLE_FILE_VALUE: the value at `place` must be `wanted`.
[[noreturn]] void refuse_value(const std::string& place, const char* wanted, const json& value);

/// The place of a value, for messages: `handle "tip"`, then `"rotate" of handle "tip"`.
std::string key_of(const std::string& owner, const char* key);

/// `value` as text for a message.
std::string shown(const json& value);

/// HANDLE_FILE_KEY if `object` has an unknown key; HANDLE_FILE_VALUE if it is not an object.
void check_keys(const json& object, const std::string& owner, const std::vector<const char*>& known);

/// The value of a key that must exist; otherwise HANDLE_FILE_KEY.
const json& required(const json& object, absl::string_view owner, const char* key);

double number(const json& value, const std::string& place);
std::array<double, 3> vector3(const json& value, const std::string& place);

/// At least one whole number from 0 to `count` - 1. `what`: the noun for messages ("vertex"). `reason`: the
/// error if a number is out of range.
std::vector<std::uint32_t> index_list(const json& list, const std::string& owner, const std::string& place,
                                      const char* what, Reason reason, std::int64_t count);

}  // namespace lpdeform::cli
