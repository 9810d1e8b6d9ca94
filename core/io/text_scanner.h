#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform {

/// Words of a text, one after the other. Blanks separate them, '#' starts a comment that ends with its line.
class TextScanner {
 public:
  enum class LineEnds {
    kPlain,
    kContinued,  // a backslash at the end of a line joins it with the next one
  };

  explicit TextScanner(std::string_view text, LineEnds line_ends = LineEnds::kPlain);

  /// The next word of this line; empty where the line has no more.
  std::string_view next_on_line();

  /// The next word, also of a later line; empty at the end of the text.
  std::string_view next();

  /// Goes to the start of the next line; false at the end of the text.
  bool skip_line();

  /// How many bytes have been read.
  std::size_t position() const { return at_; }

  /// MESH_SYNTAX at the line of the last word read: "Line 7: ...".
  absl::Status error(std::string_view what) const;

 private:
  void skip_blanks();
  std::size_t continuation_at(std::size_t at) const;

  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t last_word_ = 0;
  bool is_continued_;
};

/// A number in decimal, also "nan", "inf" and a leading '+'; too large becomes infinite. Independent of the
/// locale.
std::optional<double> to_number(std::string_view word);

/// An integer; one that does not fit becomes the nearest that does.
std::optional<std::int32_t> to_index(std::string_view word);

}  // namespace lpdeform
