#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lpdeform::reproduce {

/// Escapes text for HTML elements and attributes.
std::string escaped(std::string_view text);

/// A number with about three digits, as people write it: "0.083", "1.25", "1024".
std::string number_text(double number);

/// 0.1234 as "12.3 %".
std::string percent_text(double share);

/// An HTML table. Every cell is text. The first column is the heading of its row; the other columns are
/// right-aligned.
std::string html_table(const std::vector<std::string>& head,
                       const std::vector<std::vector<std::string>>& rows);

}  // namespace lpdeform::reproduce
