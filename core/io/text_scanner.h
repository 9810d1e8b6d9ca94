#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform {

/// Reads a text word by word. Blanks separate words; '#' starts a comment that ends with the line. Lines end in "\n" or
/// "\r\n"; or in "\r", if the text has no "\n".
class TextScanner {
 public:
  enum class LineEnds {
    kPlain,
    kContinued,  // a backslash at the end of a line joins it with the next one
  };

  explicit TextScanner(std::string_view text, LineEnds line_ends = LineEnds::kPlain);

  /// The next word of this line; empty if the line has no more.
  std::string_view next_on_line();

  /// The next word of this line or a later one; empty at the end of the text.
  std::string_view next();

  /// Goes to the start of the next line; false at the end of the text.
  bool skip_line();

  /// How many bytes have been read.
  std::size_t position() const { return at_; }

  /// The line of the last word read, from 1.
  std::int64_t line() const;

  /// MESH_SYNTAX at that line: "Line 7: ...".
  absl::Status error(std::string_view what) const;

 private:
  void skip_blanks();
  bool is_blank(char c) const;
  std::size_t continuation_at(std::size_t at) const;

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t last_word_ = 0;
  bool is_continued_;
  char line_end_;
};

/// A decimal number, also "nan", "inf" and with a leading '+'. A number that is too large becomes infinite. Empty if
/// `word` is not a number. Independent of the locale.
std::optional<double> to_number(std::string_view word);

/// An integer; if it does not fit, the nearest that does. Empty if `word` is not an integer.
std::optional<std::int32_t> to_index(std::string_view word);

}  // namespace lpdeform
