#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "core/base/fault.h"

/// Structs that carry their size in their first field, `struct_size`: see "Versions" in lpdeform.h.
namespace lpdeform::engine {

/// What `given` says, in a struct of this library's own size. `name` is for errors: INVALID_ARGUMENT
/// ARGUMENT_MISSING where it is NULL, STRUCT_SIZE where it is smaller than in the first version, STRUCT_TOO_NEW where bytes
/// that we do not know are not 0. No version but the first has been yet, so that its size is sizeof(Struct).
template <typename Struct>
absl::StatusOr<Struct> read_struct(const Struct* given, const std::string& name) {
  if (given == nullptr) {
    return argument_missing(name);
  }
  std::uint32_t size = 0;
  std::memcpy(&size, given, sizeof size);
  if (size < sizeof(Struct)) {
    return invalid_input(
        {"STRUCT_SIZE", name, absl::StrCat("struct_size >= ", sizeof(Struct))},
        absl::StrCat("struct_size of ", name, " is ", size, " and not at least ", sizeof(Struct), "."));
  }
  const auto* const bytes = reinterpret_cast<const unsigned char*>(given);
  if (std::any_of(bytes + sizeof(Struct), bytes + size, [](unsigned char byte) { return byte != 0; })) {
    return invalid_input(
        {"STRUCT_TOO_NEW", name, absl::StrCat("struct_size = ", sizeof(Struct))},
        absl::StrCat("A field of ", name, " is set that this library, which is older, does not know."));
  }
  Struct out;
  std::memcpy(&out, given, sizeof out);
  return out;
}

/// Fills in what the caller's struct has room for; its struct_size stays. `out` may be NULL.
template <typename Struct>
void write_struct(const Struct& from, Struct* out) {
  if (out == nullptr) return;
  std::uint32_t size = 0;
  std::memcpy(&size, out, sizeof size);
  if (size <= sizeof size) return;
  std::memcpy(reinterpret_cast<unsigned char*>(out) + sizeof size,
              reinterpret_cast<const unsigned char*>(&from) + sizeof size,
              std::min<std::size_t>(size, sizeof(Struct)) - sizeof size);
}

}  // namespace lpdeform::engine
