#include "client/cli/files/json_values.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/fault.h"

namespace lpdeform::cli {

void refuse(Reason reason, std::string element, std::string_view text, std::string limit) {
  throw Refusal{make_fault({reason, std::move(element), std::move(limit)}, text)};
}

std::string key_of(const std::string& owner, const char* key) {
  return absl::StrCat("\"", key, "\" of ", owner);
}

// A nested value is not printed: that would recurse as deep as a hostile file likes.
std::string shown(const json& value) {
  const bool is_nested =
      std::ranges::any_of(value, [](const json& inner) { return inner.is_structured() && !inner.empty(); });
  if (value.is_structured() && is_nested) return value.is_array() ? "a nested list" : "a nested object";
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() <= 40 ? text : text.substr(0, 37) + "...";
}

void refuse_value(const std::string& place, const char* wanted, const json& value) {
  refuse(Reason::kHandleFileValue, place,
         absl::StrCat(place, " must be ", wanted, ", not ", shown(value), "."));
}

void check_keys(const json& object, const std::string& owner, const std::vector<const char*>& known) {
  if (!object.is_object()) refuse_value(owner, "an object", object);
  for (const auto& [key, value] : object.items()) {
    if (std::ranges::find(known, key) != known.end()) continue;
    refuse(Reason::kHandleFileKey, owner,
           absl::StrCat(owner, " has the unknown key \"", key, "\"; known are ", absl::StrJoin(known, ", "),
                        "."));
  }
}

const json& required(const json& object, absl::string_view owner, const char* key) {
  if (!object.contains(key)) {
    refuse(Reason::kHandleFileKey, std::string(owner), absl::StrCat(owner, " has no \"", key, "\"."));
  }
  return object[key];
}

double number(const json& value, const std::string& place) {
  if (!value.is_number()) refuse_value(place, "a number", value);
  return value.get<double>();
}

std::array<double, 3> vector3(const json& value, const std::string& place) {
  if (!value.is_array() || value.size() != 3) refuse_value(place, "three numbers [x, y, z]", value);
  return {number(value[0], place), number(value[1], place), number(value[2], place)};
}

std::vector<std::uint32_t> index_list(const json& list, const std::string& owner, const std::string& place,
                                      const char* what, Reason reason, std::int64_t count) {
  std::vector<std::uint32_t> indices;
  for (const json& index : list) {
    if (!index.is_number_integer()) refuse_value(place, "whole numbers from 0", index);
    const bool is_in_range = index.is_number_unsigned() && index.get<std::uint64_t>() < std::uint64_t(count);
    if (!is_in_range) {
      refuse(
          reason, owner,
          absl::StrCat(owner, " has ", what, " ", shown(index), ", and the mesh has 0 to ", count - 1, "."),
          absl::StrCat("0 <= ", what, " < ", count));
    }
    indices.push_back(index.get<std::uint32_t>());
  }
  return indices;
}

}  // namespace lpdeform::cli
