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

// Reading values out of JSON, with errors that name the place, the key and the value. A function that cannot give
// its value throws a Refusal, so that reading can be an expression; the file's one entry point catches it.

using nlohmann::json;

struct Refusal {
  absl::Status status;
};

[[noreturn]] void refuse(Reason reason, std::string element, std::string_view text, std::string limit = "");

/// HANDLE_FILE_VALUE: `place` must be `wanted`.
[[noreturn]] void refuse_value(const std::string& place, const char* wanted, const json& value);

/// What is being read, for messages: `handle "tip"`, then `"rotate" of handle "tip"`.
std::string key_of(const std::string& owner, const char* key);

/// `value` for a message.
std::string shown(const json& value);

/// HANDLE_FILE_KEY where `object` has another key than the known; HANDLE_FILE_VALUE where it is no object.
void check_keys(const json& object, const std::string& owner, const std::vector<const char*>& known);

/// HANDLE_FILE_KEY where there is none.
const json& required(const json& object, absl::string_view owner, const char* key);

double number(const json& value, const std::string& place);
std::array<double, 3> vector3(const json& value, const std::string& place);

/// Whole numbers from 0 to `count` - 1, at least one: `what` for messages ("vertex"). `reason` where one is out of
/// range.
std::vector<std::uint32_t> index_list(const json& list, const std::string& owner, const std::string& place,
                                      const char* what, Reason reason, std::int64_t count);

}  // namespace lpdeform::cli
