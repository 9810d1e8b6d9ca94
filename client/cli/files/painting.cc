#include "client/cli/files/painting.h"

#include <algorithm>
#include <map>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/io/text_scanner.h"

namespace lpdeform::cli {
namespace {

std::vector<std::string> names_on_line(TextScanner& scanner) {
  std::vector<std::string> names;
  for (std::string_view word = scanner.next_on_line(); !word.empty(); word = scanner.next_on_line())
    names.emplace_back(word);
  return names;
}

/// The vertices of a face line, counted from 0, as in core/io/read_obj.cc.
std::vector<std::uint32_t> face_vertices(TextScanner& scanner, std::int64_t vertices_so_far) {
  std::vector<std::uint32_t> vertices;
  for (std::string_view word = scanner.next_on_line(); !word.empty(); word = scanner.next_on_line()) {
    const std::int64_t number = to_index(word.substr(0, word.find('/'))).value_or(0);
    const std::int64_t vertex = number >= 0 ? number - 1 : vertices_so_far + number;
    if (vertex >= 0) vertices.push_back(static_cast<std::uint32_t>(vertex));
  }
  return vertices;
}

void cover(std::vector<double>& field, const std::vector<std::uint32_t>& vertices, double value,
           std::int64_t vertex_count) {
  if (field.size() == 1) field.assign(static_cast<std::size_t>(vertex_count), field[0]);
  for (const std::uint32_t vertex : vertices) {
    if (vertex < field.size()) field[vertex] = value;
  }
}

absl::Status cover_named(const std::vector<VertexGroup>& groups, const Paint& paint,
                         std::int64_t vertex_count, std::vector<double>& field) {
  bool is_known = false;
  for (const VertexGroup& group : groups) {
    if (group.name != paint.group) continue;
    cover(field, group.vertices, paint.value, vertex_count);
    is_known = true;
  }
  if (is_known) return absl::OkStatus();
  std::vector<std::string> names;
  for (const VertexGroup& group : groups) names.push_back(group.name);
  const std::string known = names.empty() ? "none" : absl::StrJoin(names, ", ");
  return make_fault({Reason::kGroupUnknown, paint.group, ""},
                    absl::StrCat("There is no group \"", paint.group, "\"; there are: ", known, "."));
}

}  // namespace

absl::StatusOr<Paint> parse_paint(std::string_view text) {
  const std::size_t equals = text.rfind('=');
  Paint paint;
  const bool is_whole = equals != std::string_view::npos && equals > 0 &&
                        absl::SimpleAtod(std::string(text.substr(equals + 1)), &paint.value);
  if (!is_whole) {
    return make_fault({Reason::kPaintSyntax, std::string(text), "NAME=VALUE"},
                      absl::StrCat("\"", std::string(text), "\" is not NAME=VALUE."));
  }
  paint.group = std::string(text.substr(0, equals));
  return paint;
}

std::vector<VertexGroup> obj_groups(std::string_view obj_source) {
  std::map<std::string, std::vector<std::uint32_t>> found;
  std::vector<std::string> groups, object;
  std::int64_t vertices = 0;
  TextScanner scanner(obj_source, TextScanner::LineEnds::kContinued);
  do {
    const std::string_view keyword = scanner.next_on_line();
    if (keyword == "v") ++vertices;
    if (keyword == "g") groups = names_on_line(scanner);
    if (keyword == "o") object = names_on_line(scanner);
    if (keyword != "f" || (groups.empty() && object.empty())) continue;
    const std::vector<std::uint32_t> face = face_vertices(scanner, vertices);
    for (const auto* names : {&groups, &object}) {
      for (const std::string& name : *names) {
        std::vector<std::uint32_t>& members = found[name];
        members.insert(members.end(), face.begin(), face.end());
      }
    }
  } while (scanner.skip_line());
  std::vector<VertexGroup> result;
  for (auto& [name, members] : found) {
    std::ranges::sort(members);
    members.erase(std::ranges::unique(members).begin(), members.end());
    result.push_back({name, std::move(members)});
  }
  return result;
}

absl::Status paint(const std::vector<VertexGroup>& groups, const std::vector<Paint>& p_paints,
                   const std::vector<Paint>& stiffness_paints, std::int64_t vertex_count,
                   PaintedFields& fields) {
  for (const VertexGroup& group : groups) {
    if (group.p) cover(fields.p, group.vertices, *group.p, vertex_count);
    if (group.stiffness) cover(fields.stiffness, group.vertices, *group.stiffness, vertex_count);
  }
  absl::Status status;
  for (const Paint& one : p_paints) status.Update(cover_named(groups, one, vertex_count, fields.p));
  for (const Paint& one : stiffness_paints)
    status.Update(cover_named(groups, one, vertex_count, fields.stiffness));
  return status;
}

}  // namespace lpdeform::cli
