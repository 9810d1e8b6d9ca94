#include "client/cli/reproduce/markup.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"

namespace lpdeform::reproduce {

std::string escaped(std::string_view text) {
  return absl::StrReplaceAll({text.data(), text.size()},
                             {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}});
}

std::string number_text(double number) {
  const double size = std::abs(number);
  if (size >= 100 && size < 1e6) return absl::StrFormat("%.0f", number);
  return absl::StrFormat("%.3g", number);
}

std::string percent_text(double share) {
  return absl::StrFormat("%.1f %%", 100 * share);
}

std::string html_table(const std::vector<std::string>& head,
                       const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"wide\"><table>\n<thead><tr>";
  for (const std::string& cell : head) absl::StrAppend(&html, "<th scope=\"col\">", escaped(cell), "</th>");
  absl::StrAppend(&html, "</tr></thead>\n<tbody>\n");
  for (const std::vector<std::string>& row : rows) {
    absl::StrAppend(&html, "<tr>");
    for (std::size_t k = 0; k < row.size(); ++k) {
      absl::StrAppend(&html, k == 0 ? "<th scope=\"row\">" : "<td>", escaped(row[k]),
                      k == 0 ? "</th>" : "</td>");
    }
    absl::StrAppend(&html, "</tr>\n");
  }
  return html + "</tbody></table></div>\n";
}

}  // namespace lpdeform::reproduce
