#pragma once

#include <cstddef>
#include <type_traits>
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

template <typename Cases, typename Variant, std::size_t... I>
constexpr bool has_case_for_each(std::index_sequence<I...> /* of the alternatives */) {
  return (std::is_invocable_v<Cases&, decltype(std::get<I>(std::declval<Variant>()))> && ...);
}

template <typename Cases, typename Variant>
concept HasCaseForEach = has_case_for_each<Cases, Variant>(
    std::make_index_sequence<std::variant_size_v<std::remove_cvref_t<Variant>>>());

/// Calls the case for the alternative that `variant` holds. An alternative without a case does not compile, so the
/// compiler lists all places that need code for a new alternative. Give each alternative a case of its own; never use
/// `const auto&`.
template <typename Variant, typename... Cases>
requires HasCaseForEach<Match<std::remove_cvref_t<Cases>...>, Variant>
decltype(auto) match(Variant&& variant, Cases&&... cases) {
  return std::visit(Match{std::forward<Cases>(cases)...}, std::forward<Variant>(variant));
}

}  // namespace lpdeform
