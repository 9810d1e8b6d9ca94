#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "client/c/lpdeform.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

/// Structs that carry their size in their first field, `struct_size`: see "Versions" in lpdeform.h.
namespace lpdeform::engine {

/// The size of a struct in the first version. Only structs that have grown since have a size other than sizeof(Struct).
template <typename Struct>
inline constexpr std::size_t kFirstSize = sizeof(Struct);
template <>
inline constexpr std::size_t kFirstSize<lpdeform_update> = offsetof(lpdeform_update, begins_step);
template <>
inline constexpr std::size_t kFirstSize<lpdeform_settings> = offsetof(lpdeform_settings, set_search);
template <>
inline constexpr std::size_t kFirstSize<lpdeform_solve_options> = offsetof(lpdeform_solve_options, search);
template <>
inline constexpr std::size_t kFirstSize<lpdeform_mesh> = offsetof(lpdeform_mesh, weld_tolerance);

/// Copies `given` to a struct of this library's size. Fields that the caller does not know yet are 0. `name` is for
/// errors: INVALID_ARGUMENT ARGUMENT_MISSING if `given` is NULL, STRUCT_SIZE if it is smaller than in the first
/// version, STRUCT_TOO_NEW if bytes that this library does not know are not 0.
template <typename Struct>
absl::StatusOr<Struct> read_struct(const Struct* given, const std::string& name) {
  if (given == nullptr) {
    return argument_missing(name);
  }
  std::uint32_t size = 0;
  std::memcpy(&size, given, sizeof size);
  constexpr std::size_t least = kFirstSize<Struct>;
  if (size < least) {
    return make_fault({Reason::kStructSize, name, absl::StrCat("struct_size >= ", least)},
                      absl::StrCat("struct_size of ", name, " is ", size, " and not at least ", least, "."));
  }
  const std::size_t known = std::min<std::size_t>(size, sizeof(Struct));
  const auto* const bytes = reinterpret_cast<const unsigned char*>(given);
  if (std::any_of(bytes + known, bytes + size, [](unsigned char byte) { return byte != 0; })) {
    return make_fault(
        {Reason::kStructTooNew, name, absl::StrCat("struct_size = ", sizeof(Struct))},
        absl::StrCat("A field of ", name, " is set that this library, which is older, does not know."));
  }
  Struct out{};
  std::memcpy(&out, given, known);
  return out;
}

/// Writes as much of `from` as the caller's struct has room for; its struct_size does not change. `out` may be NULL.
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
