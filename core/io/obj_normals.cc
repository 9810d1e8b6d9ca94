#include "core/io/obj_normals.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/io/number_text.h"
#include "core/io/text_scanner.h"
#include "core/mesh/carried_normals.h"

namespace lpdeform {
namespace {

constexpr std::int64_t kNone = -1;

/// The corners of an OBJ's faces. A draw vertex is a pair of a vertex and a normal that occur together in a corner.
struct Drawn {
  std::vector<std::int32_t> corners;   // the draw vertex of each corner of each f line, in the file's order
  std::vector<std::int32_t> vertices;  // of each draw vertex
  Points normals;                      // of each draw vertex, at rest; 0 if it has no normal
  std::vector<std::array<std::int32_t, 3>> faces;  // triangles of draw vertices
  bool has_normals = false;
};

/// Converts an OBJ number, which counts from 1 or backwards from the newest, to an index; kNone if there is none.
std::int64_t index_of(std::string_view word, std::int64_t newest) {
  const std::optional<std::int32_t> number = to_index(word);
  if (!number || *number == 0) return kNone;
  return *number > 0 ? *number - 1 : newest + *number;
}

/// "7//9" and "7/8/9" are corners at vertex 7 with normal 9.
std::string_view normal_part(std::string_view corner) {
  const std::size_t last = corner.rfind('/');
  return last == corner.find('/') ? std::string_view() : corner.substr(last + 1);
}

Eigen::RowVector3d normal_on(TextScanner& scanner) {
  Eigen::RowVector3d normal;
  for (double& number : normal) number = to_number(scanner.next_on_line()).value_or(0);
  return normal.allFinite() ? normal : Eigen::RowVector3d(Eigen::RowVector3d::Zero());
}

class Reader {
 public:
  explicit Reader(std::string_view source) : scanner_(source, TextScanner::LineEnds::kContinued) {}

  Drawn read() {
    do {
      const std::string_view keyword = scanner_.next_on_line();
      if (keyword == "v") ++vertices_;
      if (keyword == "vn") normals_.push_back(normal_on(scanner_));
      if (keyword == "f") read_face();
    } while (scanner_.skip_line());
    drawn_.normals.resize(static_cast<Eigen::Index>(pairs_.size()), 3);
    for (const auto& [pair, draw] : pairs_) {
      const auto [vertex, normal] = pair;
      const bool is_there = normal >= 0 && normal < static_cast<std::int64_t>(normals_.size());
      drawn_.has_normals = drawn_.has_normals || is_there;
      drawn_.normals.row(draw) =
          is_there ? normals_[static_cast<std::size_t>(normal)] : Eigen::RowVector3d(0, 0, 0);
    }
    return std::move(drawn_);
  }

 private:
  void read_face() {
    const std::size_t first = drawn_.corners.size();
    for (std::string_view word = scanner_.next_on_line(); !word.empty(); word = scanner_.next_on_line()) {
      const std::int64_t vertex = index_of(word.substr(0, word.find('/')), vertices_);
      const std::int64_t normal = index_of(normal_part(word), static_cast<std::int64_t>(normals_.size()));
      const auto next = static_cast<std::int32_t>(pairs_.size());
      const auto [pair, is_new] = pairs_.try_emplace({vertex, std::max(normal, kNone)}, next);
      if (is_new) drawn_.vertices.push_back(static_cast<std::int32_t>(vertex));
      drawn_.corners.push_back(pair->second);
    }
    for (std::size_t k = first + 2; k < drawn_.corners.size(); ++k)
      drawn_.faces.push_back({drawn_.corners[first], drawn_.corners[k - 1], drawn_.corners[k]});
  }

  TextScanner scanner_;
  std::int64_t vertices_ = 0;
  std::vector<Eigen::RowVector3d> normals_;
  std::map<std::pair<std::int64_t, std::int64_t>, std::int32_t> pairs_;
  Drawn drawn_;
};

/// Draw vertices of the same vertex are copies; with `weld`, so are draw vertices at the same position.
Weld weld_of(const Drawn& drawn, const Points& rest, std::optional<double> weld) {
  if (weld) return weld_by_position(rest, *weld).value();
  std::map<std::int32_t, std::uint32_t> first;
  std::vector<std::uint32_t> groups;
  for (const std::int32_t vertex : drawn.vertices)
    groups.push_back(first.try_emplace(vertex, static_cast<std::uint32_t>(groups.size())).first->second);
  return weld_by_groups(rest, groups).value();
}

Points normals_at(const Drawn& drawn, const Points& rest, const Points& positions,
                  std::optional<double> weld) {
  Faces faces(static_cast<Eigen::Index>(drawn.faces.size()), 3);
  for (std::size_t f = 0; f < drawn.faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) faces(static_cast<Eigen::Index>(f), k) = drawn.faces[f][k];
  }
  const Points at_rest = rows_of(rest, drawn.vertices);
  const CarriedNormals carried(std::move(faces), at_rest, weld_of(drawn, at_rest, weld),
                               drawn.has_normals ? drawn.normals : Points(0, 3));
  return carried.at(rows_of(positions, drawn.vertices));
}

/// What the first line of a text ends with.
std::string_view line_end_of(std::string_view text) {
  const std::size_t end = text.find('\n');
  if (end == std::string_view::npos) return text.find('\r') == std::string_view::npos ? "\n" : "\r";
  return end > 0 && text[end - 1] == '\r' ? "\r\n" : "\n";
}

/// Copies the source line by line, with new coordinates in its v lines. Its vn lines are left out; new vn lines go
/// before the first f line.
class Writer {
 public:
  Writer(std::string_view source, const Points& positions, const Drawn& drawn, const Points& normals)
      : source_(source),
        line_end_(line_end_of(source)),
        positions_(positions),
        drawn_(drawn),
        normals_(normals),
        scanner_(source, TextScanner::LineEnds::kContinued) {}

  std::string write() {
    for (bool has_more = true; has_more;) {
      const std::string_view keyword = scanner_.next_on_line();
      const auto begin = static_cast<std::size_t>(keyword.data() - source_.data());
      if (keyword == "vn") copy_to(begin);
      if (keyword == "v") write_vertex();
      if (keyword == "f") write_face(begin);
      has_more = scanner_.skip_line();
      if (keyword == "vn") copied_ = scanner_.position();
    }
    copy_to(source_.size());
    return std::move(text_);
  }

 private:
  void copy_to(std::size_t end) {
    text_.append(source_, copied_, end - copied_);
    copied_ = end;
  }

  void write_vertex() {
    const auto begin = static_cast<std::size_t>(scanner_.next_on_line().data() - source_.data());
    scanner_.next_on_line();
    scanner_.next_on_line();
    copy_to(begin);
    append_point(text_, positions_, vertex_++);
    copied_ = scanner_.position();
  }

  void write_face(std::size_t begin) {
    copy_to(begin);
    for (Eigen::Index n = 0; corner_ == 0 && n < normals_.rows(); ++n) {
      text_ += "vn ";
      append_point<float>(text_, normals_, n);
      text_ += line_end_;
    }
    for (std::string_view word = scanner_.next_on_line(); !word.empty(); word = scanner_.next_on_line()) {
      const std::size_t first = word.find('/'), second = word.find('/', first + 1);
      const bool has_texture = first != std::string_view::npos;
      const std::string_view kept = word.substr(0, has_texture ? second : std::string_view::npos);
      copy_to(static_cast<std::size_t>(kept.data() - source_.data()) + kept.size());
      text_ += has_texture ? "/" : "//";
      append_number(text_, drawn_.corners[corner_++] + 1);
      copied_ = scanner_.position();
    }
  }

  const std::string_view source_, line_end_;
  const Points& positions_;
  const Drawn& drawn_;
  const Points& normals_;
  TextScanner scanner_;
  std::string text_;
  std::size_t copied_ = 0;
  Eigen::Index vertex_ = 0;
  std::size_t corner_ = 0;
};

}  // namespace

std::string obj_text_with_normals(const MeshFile& file, const Points& positions, std::optional<double> weld) {
  LPDEFORM_CHECK(positions.rows() == file.mesh.vertices.rows());
  const std::string source = obj_text(file, file.mesh.vertices);
  const Drawn drawn = Reader(source).read();
  const Points normals = normals_at(drawn, file.mesh.vertices, positions, weld);
  return Writer(source, positions, drawn, normals).write();
}

bool has_obj_normals(const MeshFile& file) {
  TextScanner scanner(file.obj_source, TextScanner::LineEnds::kContinued);
  do {
    if (scanner.next_on_line() == "vn") return true;
  } while (scanner.skip_line());
  return false;
}

}  // namespace lpdeform
