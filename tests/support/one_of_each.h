#pragma once

#include <cstddef>
#include <utility>
#include <variant>
#include <vector>

namespace lpdeform {

/// One value of each alternative of a std::variant, as it is made by default: a test over them covers a new one by itself.
template <typename Variant>
std::vector<Variant> one_of_each() {
  return []<std::size_t... I>(std::index_sequence<I...>) {
    return std::vector<Variant>{Variant(std::in_place_index<I>)...};
  }
  (std::make_index_sequence<std::variant_size_v<Variant>>());
}

}  // namespace lpdeform
