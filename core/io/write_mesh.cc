#include <cstdint>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/colour.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/io/byte_order.h"
#include "core/io/mesh_io.h"
#include "core/io/number_text.h"
#include "core/io/text_scanner.h"
#include "core/io/whole_file.h"

namespace lpdeform {
namespace {

void append_face(std::string& text, std::string_view head, const Faces& faces, Eigen::Index f,
                 int first_index) {
  text += head;
  for (int corner = 0; corner < 3; ++corner) {
    text += ' ';
    append_number(text, std::int64_t{faces(f, corner)} + first_index);
  }
  text += '\n';
}

std::string off_text(const Faces& faces, const Points& positions) {
  std::string text = absl::StrCat("OFF\n", positions.rows(), " ", faces.rows(), " 0\n");
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    append_point(text, positions, v);
    text += '\n';
  }
  for (Eigen::Index f = 0; f < faces.rows(); ++f) append_face(text, "3", faces, f, 0);
  return text;
}

std::string plain_obj_text(const Faces& faces, const Points& positions) {
  std::string text;
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    text += "v ";
    append_point(text, positions, v);
    text += '\n';
  }
  for (Eigen::Index f = 0; f < faces.rows(); ++f) append_face(text, "f", faces, f, 1);
  return text;
}

/// `source` with the first three numbers of its v lines replaced.
std::string moved_obj_text(std::string_view source, const Points& positions) {
  std::string text;
  std::size_t copied = 0;
  Eigen::Index v = 0;
  TextScanner scanner(source, TextScanner::LineEnds::kContinued);
  do {
    if (scanner.next_on_line() != "v") continue;
    LPDEFORM_CHECK(v < positions.rows());
    const std::size_t begin = static_cast<std::size_t>(scanner.next_on_line().data() - source.data());
    scanner.next_on_line();
    scanner.next_on_line();
    text.append(source, copied, begin - copied);
    append_point(text, positions, v++);
    copied = scanner.position();
  } while (scanner.skip_line());
  LPDEFORM_CHECK(v == positions.rows());
  text.append(source, copied);
  return text;
}

std::string ply_header(Eigen::Index vertices, Eigen::Index faces, bool has_normals, bool has_distortion) {
  return absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ", vertices,
                      "\nproperty double x\nproperty double y\nproperty double z\n",
                      has_normals ? "property float nx\nproperty float ny\nproperty float nz\n" : "",
                      has_distortion
                          ? "property double distortion\nproperty uchar red\nproperty uchar green\n"
                            "property uchar blue\n"
                          : "",
                      "element face ", faces, "\nproperty list uchar int vertex_indices\nend_header\n");
}

std::string ply_bytes(const Faces& faces, const Points& positions, const Field& distortion,
                      const Points& normals) {
  const bool has_distortion = distortion.size() > 0, has_normals = normals.rows() > 0;
  const std::vector<Rgb> colours = distortion_colours(distortion);
  std::string bytes = ply_header(positions.rows(), faces.rows(), has_normals, has_distortion);
  for (Eigen::Index v = 0; v < positions.rows(); ++v) {
    for (int axis = 0; axis < 3; ++axis) append_little_endian(bytes, positions(v, axis));
    for (int axis = 0; has_normals && axis < 3; ++axis)
      append_little_endian(bytes, static_cast<float>(normals(v, axis)));
    if (!has_distortion) continue;
    append_little_endian(bytes, distortion[v]);
    for (const std::uint8_t channel : colours[v]) append_little_endian(bytes, channel);
  }
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    append_little_endian(bytes, std::uint8_t{3});
    for (int corner = 0; corner < 3; ++corner) append_little_endian(bytes, faces(f, corner));
  }
  return bytes;
}

absl::Status cannot_write_stl(const std::filesystem::path& path) {
  return make_fault({Reason::kMeshFormatUnknown, path.string(), "one of .off, .obj, .ply"},
                    absl::StrCat("Cannot write ", path.string(),
                                 ": an STL file keeps no vertex order; use .off, .obj or .ply."));
}

}  // namespace

std::string obj_text(const MeshFile& file, const Points& positions) {
  LPDEFORM_CHECK(positions.rows() == file.mesh.vertices.rows());
  if (file.obj_source.empty()) return plain_obj_text(file.mesh.faces, positions);
  return moved_obj_text(file.obj_source, positions);
}

absl::Status write_mesh(const std::filesystem::path& path, const MeshFile& file, const Points& positions,
                        const Field& distortion, const Points& normals) {
  LPDEFORM_CHECK(positions.rows() == file.mesh.vertices.rows());
  LPDEFORM_CHECK(normals.rows() == 0 || normals.rows() == positions.rows());
  LPDEFORM_CHECK(distortion.size() == 0 || distortion.size() == positions.rows());
  const absl::StatusOr<MeshFormat> format = mesh_format(path);
  if (!format.ok()) return format.status();
  switch (*format) {
    case MeshFormat::kOff:
      return write_whole_file(path, off_text(file.mesh.faces, positions));
    case MeshFormat::kObj:
      return write_whole_file(path, obj_text(file, positions));
    case MeshFormat::kPly:
      return write_whole_file(path, ply_bytes(file.mesh.faces, positions, distortion, normals));
    case MeshFormat::kStl:
      return cannot_write_stl(path);
  }
  return absl::InternalError("not a mesh format");
}

}  // namespace lpdeform
