#include "client/cli/files/field_file.h"

#include <string>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"
#include "client/cli/files/text_file.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::cli {

absl::StatusOr<std::vector<double>> parse_field(std::string_view text, std::int64_t vertex_count,
                                                std::string_view name) {
  const std::string file(name);
  std::vector<double> numbers;
  const absl::string_view whole =
      absl::StripTrailingAsciiWhitespace(absl::string_view(text.data(), text.size()));
  if (!whole.empty()) {
    for (const absl::string_view line : absl::StrSplit(whole, '\n')) {
      if (!absl::SimpleAtod(line, &numbers.emplace_back())) {
        return make_fault({Reason::kFieldFileSyntax, absl::StrCat("line ", numbers.size()), ""},
                          absl::StrCat("Line ", numbers.size(), " of \"", file, "\" is \"",
                                       line.substr(0, 40), "\" and not one number."));
      }
    }
  }
  if (static_cast<std::int64_t>(numbers.size()) == vertex_count) return numbers;
  return make_fault({Reason::kFieldSize, file, absl::StrCat("lines = ", vertex_count)},
                    absl::StrCat("\"", file, "\" has ", numbers.size(), " numbers for ", vertex_count,
                                 " vertices; it takes one a vertex."));
}

absl::StatusOr<std::vector<double>> read_field(const std::filesystem::path& path, std::int64_t vertex_count) {
  const absl::StatusOr<std::string> text = read_text(path);
  if (!text.ok()) return text.status();
  return parse_field(*text, vertex_count, path.string());
}

}  // namespace lpdeform::cli
