#include "server/flags.h"

#include <algorithm>
#include <iterator>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "core/base/fault.h"
#include "core/base/match.h"

namespace lpdeform {
namespace {

constexpr std::uint64_t kKiB = 1024;

double seconds_of(std::chrono::milliseconds time) {
  return std::chrono::duration<double>(time).count();
}

/// "256MiB", where that is exact.
std::string size_text(std::uint64_t bytes) {
  static constexpr const char* kUnits[] = {"", "KiB", "MiB", "GiB", "TiB"};
  std::size_t unit = 0;
  for (; bytes != 0 && bytes % kKiB == 0 && unit + 1 < std::size(kUnits); ++unit) bytes /= kKiB;
  return absl::StrCat(bytes, kUnits[unit]);
}

/// The number that the range applies to; empty if there is none.
std::optional<double> number_in(const FlagValue& value) {
  using Number = std::optional<double>;
  return match(
      value, [](const std::string*) { return Number(); }, [](const bool*) { return Number(); },
      [](const int* number) { return Number(*number); },
      [](const std::uint32_t* number) { return Number(*number); },
      [](const std::size_t* number) { return Number(static_cast<double>(*number)); },
      [](const double* number) { return Number(*number); },
      [](const std::chrono::milliseconds* time) { return Number(seconds_of(*time)); },
      [](const ByteLimit* limit) { return limit->bytes ? Number() : Number(limit->percent); },
      [](const SizeValue& size) { return Number(static_cast<double>(*size.bytes)); },
      [](const MemoryValue&) { return Number(); });
}

/// "1234567" with commas, "256MiB" with a space, and "s" after seconds.
std::string in_table(const Flag& flag) {
  const std::string value = value_of(flag);
  const std::size_t digits = std::min(value.find_first_not_of("0123456789"), value.size());
  std::string out;
  for (std::size_t k = 0; k < digits; ++k) {
    if (k > 0 && (digits - k) % 3 == 0) out += ',';
    out += value[k];
  }
  const std::string unit = value.substr(digits);
  if (std::holds_alternative<std::chrono::milliseconds*>(flag.value)) return absl::StrCat(out, unit, " s");
  return absl::StrCat(out, unit.empty() || unit == "%" ? "" : " ", unit);
}

}  // namespace

Arguments::Arguments() {
  server.address = "127.0.0.1:50051";
}

std::string environment_variable(const Flag& flag) {
  return absl::StrCat("LPDEFORM_", absl::AsciiStrToUpper(absl::StrReplaceAll(flag.name, {{"-", "_"}})));
}

std::string help_of(const Flag& flag) {
  return *flag.range.text == '\0' ? flag.help : absl::StrCat(flag.help, " (", flag.range.text, ")");
}

std::string value_of(const Flag& flag) {
  return match(
      flag.value, [](const std::string* text) { return *text; },
      [](const bool* is_set) { return std::string(*is_set ? "true" : ""); },
      [](const int* number) { return absl::StrCat(*number); },
      [](const std::uint32_t* number) { return absl::StrCat(*number); },
      [](const std::size_t* number) { return absl::StrCat(*number); },
      [](const double* number) { return absl::StrCat(*number); },
      [](const std::chrono::milliseconds* time) { return absl::StrCat(seconds_of(*time)); },
      [](const ByteLimit* limit) {
        return limit->bytes ? size_text(*limit->bytes) : absl::StrCat(limit->percent, "%");
      },
      [](const SizeValue& size) { return size_text(*size.bytes); },
      [](const MemoryValue& size) { return size_text(*size.bytes); });
}

absl::Status must_be(const std::string& name, const std::string& what) {
  return make_fault({Reason::kOptionOutOfRange, absl::StrReplaceAll(name, {{"-", "_"}}), what},
                    absl::StrCat("--", name, " must be ", what, "."));
}

absl::Status check_range(const Flag& flag, double number) {
  const FlagRange& range = flag.range;
  const bool is_in = (number >= range.least && number <= range.most) || (range.or_zero && number == 0);
  return is_in || *range.text == '\0' ? absl::OkStatus() : must_be(flag.name, range.text);
}

absl::Status check_range(const Flag& flag) {
  const std::optional<double> number = number_in(flag.value);
  return number ? check_range(flag, *number) : absl::OkStatus();
}

std::string table_of_limits() {
  std::string out = "| flag | default | what it bounds | refusal |\n|---|--:|---|---|\n";
  Arguments arguments;
  for (const Flag& flag : flags_of(arguments)) {
    if (flag.group != FlagGroup::kLimits) continue;
    const std::string refusal = flag.refusal ? absl::StrCat("`", std::string(name_of(*flag.refusal)), "` ",
                                                            absl::StatusCodeToString(code_of(*flag.refusal)))
                                             : "-";
    absl::StrAppend(&out, "| `--", flag.name, "` | ", in_table(flag), " | ", help_of(flag), " | ", refusal,
                    " |\n");
  }
  return out;
}

}  // namespace lpdeform
