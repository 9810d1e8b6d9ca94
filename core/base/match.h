#pragma once

#include <utility>
#include <variant>

namespace lpdeform {

/// Several lambdas as one: the overload set that std::visit takes.
template <typename... Cases>
struct Match : Cases... {
  using Cases::operator()...;
};
template <typename... Cases>
Match(Cases...) -> Match<Cases...>;  // clang 14 does not find it by itself

/// Calls the case for what `variant` holds. An alternative without a case does not compile, so that the compiler
/// lists the places that a new one must reach: give each alternative a case of its own, never `const auto&`.
template <typename Variant, typename... Cases>
decltype(auto) match(Variant&& variant, Cases&&... cases) {
  return std::visit(Match{std::forward<Cases>(cases)...}, std::forward<Variant>(variant));
}

}  // namespace lpdeform
