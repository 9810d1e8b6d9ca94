#pragma once

#include <charconv>
#include <string>

#include "core/base/geometry.h"

namespace lpdeform {

/// Appends the shortest text that reads back to the same number.
template <typename Number>
void append_number(std::string& text, Number number) {
  char digits[32];
  const auto result = std::to_chars(digits, digits + sizeof(digits), number);
  text.append(digits, result.ptr);
}

/// "x y z" of row v, each as a number of type Number.
template <typename Number = double>
void append_point(std::string& text, const Points& points, Eigen::Index v) {
  for (int axis = 0; axis < 3; ++axis) {
    if (axis > 0) text += ' ';
    append_number(text, static_cast<Number>(points(v, axis)));
  }
}

}  // namespace lpdeform
