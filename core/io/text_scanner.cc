#include "core/io/text_scanner.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <string>

#include "absl/strings/charconv.h"
#include "absl/strings/str_cat.h"
#include "core/io/readers.h"

namespace lpdeform {
namespace {

std::string_view without_plus(std::string_view word) {
  if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
  return word;
}

/// The value of a number that std::from_chars rejects as too large or too small: infinite or 0.
double beyond_double(std::string_view word) {
  double nearest = 0;
  absl::from_chars(word.data(), word.data() + word.size(), nearest);
  return std::abs(nearest) > 1 ? std::copysign(std::numeric_limits<double>::infinity(), nearest) : nearest;
}

}  // namespace

TextScanner::TextScanner(std::string_view text, LineEnds line_ends)
    : text_(text),
      is_continued_(line_ends == LineEnds::kContinued),
      line_end_(text.find('\n') == std::string_view::npos ? '\r' : '\n') {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (text.starts_with(kByteOrderMark)) at_ = kByteOrderMark.size();
}

bool TextScanner::is_blank(char c) const {
  return c == ' ' || c == '\t' || (c == '\r' && line_end_ != '\r') || c == '\v' || c == '\f';
}

/// The length of the line continuation (a backslash and the line end) at `at`; 0 if there is none.
std::size_t TextScanner::continuation_at(std::size_t at) const {
  if (!is_continued_ || text_[at] != '\\') return 0;
  const std::string_view rest = text_.substr(at + 1);
  if (rest.starts_with(line_end_)) return 2;
  return rest.starts_with("\r\n") ? 3 : 0;
}

void TextScanner::skip_blanks() {
  while (at_ < text_.size()) {
    if (is_blank(text_[at_])) {
      ++at_;
    } else if (text_[at_] == '#') {
      at_ = std::min(text_.find(line_end_, at_), text_.size());
    } else if (const std::size_t joint = continuation_at(at_); joint > 0) {
      at_ += joint;
    } else {
      return;
    }
  }
}

std::string_view TextScanner::next_on_line() {
  skip_blanks();
  const std::size_t begin = at_;
  while (at_ < text_.size() && text_[at_] != line_end_ && !is_blank(text_[at_]) && continuation_at(at_) == 0)
    ++at_;
  if (at_ > begin) last_word_ = begin;
  return text_.substr(begin, at_ - begin);
}

std::string_view TextScanner::next() {
  std::string_view word = next_on_line();
  while (word.empty() && skip_line()) word = next_on_line();
  return word;
}

bool TextScanner::skip_line() {
  while (at_ < text_.size() && text_[at_] != line_end_) at_ += std::max<std::size_t>(1, continuation_at(at_));
  if (at_ < text_.size()) ++at_;
  return at_ < text_.size();
}

std::int64_t TextScanner::line() const {
  return 1 + std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(last_word_), line_end_);
}

absl::Status TextScanner::error(std::string_view what) const {
  return mesh_syntax(absl::StrCat("line ", line()), what);
}

std::optional<double> to_number(std::string_view word) {
  word = without_plus(word);
  double value = 0;
  const char* const end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ptr != end || result.ec == std::errc::invalid_argument) return std::nullopt;
  if (result.ec == std::errc::result_out_of_range) return beyond_double(word);
  return value;
}

std::optional<std::int32_t> to_index(std::string_view word) {
  word = without_plus(word);
  std::int32_t value = 0;
  const char* const end = word.data() + word.size();
  const auto result = std::from_chars(word.data(), end, value);
  if (result.ptr != end || result.ec == std::errc::invalid_argument) return std::nullopt;
  if (result.ec == std::errc::result_out_of_range) {
    using Limits = std::numeric_limits<std::int32_t>;
    return word.front() == '-' ? Limits::min() : Limits::max();
  }
  return value;
}

}  // namespace lpdeform
