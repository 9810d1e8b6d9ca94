#include "core/gltf/json_parts.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::gltf {
namespace {

constexpr int kDeepest = 100;  // nlohmann-json writes by recursion
constexpr std::size_t kLongest = 60;
constexpr std::size_t kMostKeys = 100;  // glTF has 19 for its root; each look for a key goes through all

std::string sentence(const std::string& part, std::string_view what) {
  std::string text = absl::StrCat(part, " ", std::string(what), ".");
  if (text[0] >= 'a' && text[0] <= 'z') text[0] += 'A' - 'a';
  return text;
}

/// "mesh" of "meshes", "bufferView" of "bufferViews".
std::string singular(std::string_view list) {
  if (list == "meshes") return "mesh";
  return std::string(list.substr(0, list.size() - 1));
}

int depth_of(std::string_view text) {
  int depth = 0, deepest = 0;
  bool is_string = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const char c = text[k];
    if (is_string && c == '\\') ++k;
    if (c == '"') is_string = !is_string;
    if (is_string) continue;
    if (c == '{' || c == '[') deepest = std::max(deepest, ++depth);
    if (c == '}' || c == ']') --depth;
  }
  return deepest;
}

}  // namespace

void refuse(const std::string& part, std::string_view what) {
  throw Refusal{make_fault({Reason::kMeshSyntax, part, ""}, sentence(part, what))};
}

void refuse_unsupported(const std::string& part, std::string_view what) {
  throw Refusal{make_fault({Reason::kMeshUnsupported, part, ""}, sentence(part, what))};
}

Json parse_json(std::string_view text) {
  if (depth_of(text) > kDeepest) refuse("the JSON", absl::StrCat("nests deeper than ", kDeepest, " levels"));
  try {
    Json root = Json::parse(text);
    if (!root.is_object()) refuse("the JSON", "is no object");
    if (root.size() > kMostKeys) refuse("the JSON", absl::StrCat("has more than ", kMostKeys, " keys"));
    return root;
  } catch (const Json::parse_error& error) {
    refuse("the JSON", absl::StrCat("breaks off or is wrong at byte ", error.byte));
  } catch (const Json::exception&) {
    refuse("the JSON", "has a number that is out of range");
  }
}

std::string printable(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f || c == '"') c = '?';
  }
  if (text.size() <= kLongest) return text;
  std::size_t end = kLongest;  // not within a character of UTF-8
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, end) + "...";
}

std::string part_name(const Json& root, const char* list, std::size_t index) {
  const std::string plain = absl::StrCat(singular(list), " ", index);
  if (index >= count_of(root, list)) return plain;
  const Json* const name = value_of(root[list][index], "name");
  if (name == nullptr || !name->is_string() || name->get_ref<const std::string&>().empty()) return plain;
  return absl::StrCat(plain, " (\"", printable(name->get<std::string>()), "\")");
}

std::size_t count_of(const Json& root, const char* list) {
  const Json* const items = value_of(root, list);
  if (items == nullptr) return 0;
  if (!items->is_array()) refuse(absl::StrCat("\"", list, "\""), "is no list");
  return items->size();
}

const Json& item(const Json& root, const char* list, std::size_t index) {
  LPDEFORM_CHECK(index < count_of(root, list));
  const Json& found = root[list][index];
  if (!found.is_object()) refuse(part_name(root, list, index), "is no object");
  if (found.size() > kMostKeys)
    refuse(part_name(root, list, index), absl::StrCat("has more than ", kMostKeys, " keys"));
  return found;
}

const Json* value_of(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto found = object.find(key);
  return found == object.end() ? nullptr : &*found;
}

std::uint64_t whole(const Json& object, const char* key, std::uint64_t otherwise, const std::string& part) {
  constexpr double kMost = 1LL << 40;
  const Json* const value = value_of(object, key);
  if (value == nullptr) return otherwise;
  const double number = value->is_number() ? value->get<double>() : -1;
  if (!(number >= 0 && number <= kMost && number == std::floor(number)))
    refuse(part, absl::StrCat("has a \"", key, "\" that is no whole number from 0 to 2^40"));
  return static_cast<std::uint64_t>(number);
}

std::size_t checked_index(const Json& root, const Json& value, const char* key, const char* list,
                          const std::string& part) {
  const std::size_t count = count_of(root, list);
  if (!value.is_number_unsigned() || value.get<std::uint64_t>() >= count)
    refuse(part, absl::StrCat("names by \"", key, "\" none of the ", count, " ", list));
  return value.get<std::size_t>();
}

std::size_t needed_index(const Json& root, const Json& object, const char* key, const char* list,
                         const std::string& part) {
  const Json* const value = value_of(object, key);
  if (value == nullptr) refuse(part, absl::StrCat("has no \"", key, "\""));
  return checked_index(root, *value, key, list, part);
}

std::vector<double> numbers(const Json& object, const char* key, std::size_t count, const std::string& part) {
  const Json* const list = value_of(object, key);
  const bool is_list = list != nullptr && list->is_array() && list->size() == count &&
                       std::ranges::all_of(*list, [](const Json& one) { return one.is_number(); });
  if (!is_list) refuse(part, absl::StrCat("has a \"", key, "\" that is no list of ", count, " numbers"));
  std::vector<double> result;
  for (const Json& one : *list) result.push_back(one.get<double>());
  return result;
}

}  // namespace lpdeform::gltf
