#include <algorithm>
#include <bit>

#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

std::string refused(std::string_view bytes) {
  return refused_at(bytes, MeshFormat::kPly);
}

/// Appends numbers in one byte order.
class Bytes {
 public:
  explicit Bytes(std::endian order) : order_(order) {}

  template <typename Number>
  Bytes& operator<<(Number number) {
    char raw[sizeof(Number)];
    std::memcpy(raw, &number, sizeof(Number));
    if (order_ != std::endian::native) std::reverse(raw, raw + sizeof(Number));
    text_.append(raw, sizeof(Number));
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  std::endian order_;
  std::string text_;
};

std::string head(std::string_view format, std::string_view lines) {
  return "ply\nformat " + std::string(format) + " 1.0\n" + std::string(lines) + "end_header\n";
}

std::string_view format_name(std::endian order) {
  return order == std::endian::big ? "binary_big_endian" : "binary_little_endian";
}

constexpr std::string_view kTriangleLines =
    "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\n";

const TriangleMesh kTriangle = make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1.5, -0.25}}, {{0, 1, 2}});

void expect_triangle(std::string_view bytes) {
  const TriangleMesh mesh = parsed(bytes, MeshFormat::kPly);
  EXPECT_TRUE(same_bits(mesh.vertices, kTriangle.vertices)) << mesh.vertices;
  EXPECT_TRUE(same_faces(mesh.faces, kTriangle.faces)) << mesh.faces;
}

std::string binary_triangle(std::endian order) {
  Bytes data(order);
  data << 0.f << 0.f << 0.f << 1.f << 0.f << 0.f << 0.f << 1.5f << -0.25f;
  data << std::uint8_t{3} << 0 << 1 << 2;
  return head(format_name(order), kTriangleLines) + data.text();
}

TEST(Ply, ReadsAscii) {
  expect_triangle(head("ascii", kTriangleLines) + "0 0 0\n1 0 0\n0 1.5 -0.25\n3 0 1 2\n");
  expect_triangle(
      "ply\r\nformat ascii 1.0\r\ncomment a b\r\nobj_info c\r\nelement vertex 3\r\nproperty float32 x\r\n"
      "property float64 y\r\nproperty double z\r\nelement face 1\r\nproperty list uint8 int32 "
      "vertex_index\r\n"
      "end_header\r\n0 0 0\r\n1 0 0\r\n0 1.5 -0.25\r\n3 0 1 2\r\n");
}

TEST(Ply, ReadsBothByteOrders) {
  expect_triangle(binary_triangle(std::endian::little));
  expect_triangle(binary_triangle(std::endian::big));
}

TEST(Ply, ReadsEveryTypeAndSkipsUnknownPropertiesAndElements) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    Bytes data(order);
    data << std::uint16_t{2} << 0.5f << 0.5f << std::int8_t{-1};  // element before: a list and a number
    for (Eigen::Index v = 0; v < 3; ++v) {
      data << std::uint8_t{9} << kTriangle.vertices(v, 2) << std::int32_t{2} << std::int16_t{-7}
           << std::int16_t{8};
      data << static_cast<float>(kTriangle.vertices(v, 1))
           << static_cast<std::int16_t>(kTriangle.vertices(v, 0));
    }
    data << 1.0 << std::uint32_t{3} << std::uint16_t{0} << std::uint16_t{1} << std::uint16_t{2}
         << std::int8_t{0};
    const std::string lines =
        "element camera 1\nproperty list ushort float view\nproperty char flag\n"
        "element vertex 3\nproperty uchar red\nproperty double z\nproperty list int short tags\nproperty "
        "float y\n"
        "property short x\n"
        "element face 1\nproperty double quality\nproperty list uint ushort vertex_index\nproperty list char "
        "int none\n"
        "element nothing 4000000000\n";
    expect_triangle(head(format_name(order), lines) + data.text());
  }
}

TEST(Ply, CutsPolygonsIntoFans) {
  const TriangleMesh mesh =
      parsed(head("ascii",
                  "element vertex 4\nproperty int x\nproperty int y\nproperty int z\nelement face 2\n"
                  "property list uchar int vertex_indices\n") +
                 "0 0 0 1 0 0 1 1 0 0 1 0\n4 0 1 2 3\n2 0 1\n",
             MeshFormat::kPly);
  EXPECT_TRUE(same_faces(mesh.faces, make_mesh({}, {{0, 1, 2}, {0, 2, 3}}).faces));
}

TEST(Ply, NamesACornerWhoseVertexIsNotThereAsTheFileCounts) {
  for (const std::string corner : {"3", "-1", "0.5", "4294967295", "nan"}) {
    EXPECT_EQ(refusal_of(head("ascii", kTriangleLines) + "0 0 0\n1 0 0\n0 1.5 -0.25\n3 0 1 " + corner + "\n",
                         MeshFormat::kPly),
              "Line 13: face 0 of 1 has the corner " + corner + "; there are 3 vertices, counted from 0.");
  }
}

TEST(Ply, NamesABinaryCornerWhoseVertexIsNotThere) {
  std::string bytes = binary_triangle(std::endian::little);
  const std::size_t end = bytes.size();
  bytes[end - 4] = 7;
  EXPECT_EQ(refusal_of(bytes, MeshFormat::kPly),
            "Byte " + std::to_string(end) +
                ": face 0 of 1 has the corner 7; there are 3 vertices, counted from 0.");
}

TEST(Ply, FacesMayStandBeforeTheirVertices) {
  const std::string lines = head("ascii",
                                 "element face 1\nproperty list uchar int vertex_indices\nelement vertex 3\n"
                                 "property int x\nproperty int y\nproperty int z\n");
  const std::string vertices = "0 0 0\n1 0 0\n0 1 0\n";
  EXPECT_EQ(parsed(lines + "3 0 1 2\n" + vertices, MeshFormat::kPly).faces.rows(), 1);
  EXPECT_EQ(refused(lines + "3 0 1 3\n" + vertices), "line 10");
}

TEST(Ply, NamesAVertexThatIsNotFinite) {
  EXPECT_EQ(refusal_of(head("ascii", kTriangleLines) + "0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n", MeshFormat::kPly),
            "Line 11: vertex 1 of 3 has a NaN or infinite coordinate.");
}

TEST(Ply, RefusesHeadersThatMakeNoSense) {
  EXPECT_EQ(refused(""), "line 1");
  EXPECT_EQ(refused("plyx\n"), "line 1");
  EXPECT_EQ(refused("ply\nformat utf8 1.0\n"), "line 2");
  EXPECT_EQ(refused("ply\nelement vertex 0\nend_header\n"), "line 3");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nproperty float x\n"), "line 3");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nelement vertex -1\n"), "line 3");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nelement vertex 99999999999999999999\n"), "line 3");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nelement vertex 1\nproperty quad x\n"), "line 4");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nelement vertex 1\nproperty float\n"), "line 4");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nelement vertex 1\nproperty list float int x\n"), "line 4");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nnonsense\n"), "line 3");
  EXPECT_EQ(refused("ply\nformat ascii 1.0\nelement vertex 0\n"), "line 3") << "ends before end_header";
  EXPECT_EQ(refused(head("ascii", "element vertex 1\nproperty float x\nproperty float y\n") + "0 0\n"),
            "element vertex");
}

TEST(Ply, RefusesTruncatedFiles) {
  for (const std::endian order : {std::endian::little, std::endian::big}) {
    const std::string whole = binary_triangle(order);
    for (std::size_t size = 0; size < whole.size(); ++size) {
      EXPECT_NE(refused(whole.substr(0, size)), "accepted") << size;
    }
    EXPECT_EQ(refused(whole.substr(0, whole.size() - 1)), "byte " + std::to_string(whole.size() - 4));
  }
  EXPECT_NE(refused(head("ascii", kTriangleLines) + "0 0 0\n1 0 0\n0 1.5 -0.25\n3 0 1\n"), "accepted");
  EXPECT_NE(refused(head("ascii", kTriangleLines) + "0 0 0\n1 0 x\n0 1.5 -0.25\n3 0 1 2\n"), "accepted");
}

TEST(Ply, AForgedCountCostsNoMemory) {
  const std::string_view forged =
      "element vertex 9000000000000000000\nproperty float x\nproperty float y\nproperty float z\n"
      "element face 9000000000000000000\nproperty list uint int vertex_indices\n";
  EXPECT_NE(refused(head("ascii", forged) + "0 0 0\n"), "accepted");
  EXPECT_NE(refused(head("binary_big_endian", forged) + std::string(12, '\0')), "accepted");
}

TEST(Ply, AForgedListLengthCostsNoMemory) {
  const std::string_view lines = "element face 1\nproperty list uint int vertex_indices\n";
  EXPECT_NE(refused(head("ascii", lines) + "4294967295 0 0\n"), "accepted");
  EXPECT_NE(refused(head("ascii", lines) + "1e300 0 0\n"), "accepted");
  EXPECT_NE(refused(head("ascii", lines) + "-3 0 0 0\n"), "accepted");
  EXPECT_NE(refused(head("ascii", lines) + "nan 0 0 0\n"), "accepted");
  EXPECT_NE(refused(head("binary_little_endian", lines) + std::string(12, '\xff')), "accepted");
}

}  // namespace
}  // namespace lpdeform
