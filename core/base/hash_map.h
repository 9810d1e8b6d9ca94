#pragma once

#include <unordered_map>

#include "absl/container/flat_hash_map.h"
#include "absl/hash/hash.h"

namespace lpdeform {

/// A hash map for large numbers of small keys: absl::flat_hash_map. With AddressSanitizer it is std::unordered_map, because
/// Abseil's headers and Debian's library, which is not instrumented, then disagree about the layout of a table.
#if defined(__SANITIZE_ADDRESS__)
#define LPDEFORM_HAS_ADDRESS_SANITIZER
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define LPDEFORM_HAS_ADDRESS_SANITIZER
#endif
#endif
#ifdef LPDEFORM_HAS_ADDRESS_SANITIZER
template <typename Key, typename Value>
using HashMap = std::unordered_map<Key, Value, absl::Hash<Key>>;
#else
template <typename Key, typename Value>
using HashMap = absl::flat_hash_map<Key, Value>;
#endif

}  // namespace lpdeform
