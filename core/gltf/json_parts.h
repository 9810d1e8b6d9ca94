#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"

namespace lpdeform::gltf {

// Read parts of a glTF's JSON, with errors that name the part. A function that cannot return its value throws a Refusal; the
// functions of core/gltf/gltf.h catch it.

/// Keeps the order of keys, so that a written file reads like the one that it was made from.
using Json = nlohmann::ordered_json;

struct Refusal {
  absl::Status status;
};

/// Throws MESH_SYNTAX: "`part` `what`."
[[noreturn]] void refuse(const std::string& part, std::string_view what);

/// Throws MESH_UNSUPPORTED, likewise.
[[noreturn]] void refuse_unsupported(const std::string& part, std::string_view what);

/// Throws MESH_SYNTAX if `text` is no JSON object, has more than 100 keys, or nests deeper than 100 levels.
Json parse_json(std::string_view text);

/// Text of a file for a message: no quotes or control characters, and cut where it is long, between characters of UTF-8.
std::string printable(std::string text);

/// "mesh 3 ("body")", or "mesh 3" if it has no name. `list`: "meshes".
std::string part_name(const Json& root, const char* list, std::size_t index);

/// The number of items of a list of the root, 0 if there is no such list.
std::size_t count_of(const Json& root, const char* list);

/// The item, which must be an object of at most 100 keys. Requires index < count_of().
const Json& item(const Json& root, const char* list, std::size_t index);

/// The value of a key, or nullptr. `object` must be an object, or it has no keys.
const Json* value_of(const Json& object, const char* key);

/// A whole number from 0 to 2^40, `otherwise` if the key is missing.
std::uint64_t whole(const Json& object, const char* key, std::uint64_t otherwise, const std::string& part);

/// The index of an item of a list of the root: of a key that must be there, or of `value` itself.
std::size_t needed_index(const Json& root, const Json& object, const char* key, const char* list,
                         const std::string& part);
std::size_t checked_index(const Json& root, const Json& value, const char* key, const char* list,
                          const std::string& part);

/// The numbers of a list that has `count` of them.
std::vector<double> numbers(const Json& object, const char* key, std::size_t count, const std::string& part);

}  // namespace lpdeform::gltf
