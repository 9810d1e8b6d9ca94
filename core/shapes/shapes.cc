#include "core/shapes/shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/check.h"

namespace lpdeform {
namespace {

using Triangle = std::array<std::int32_t, 3>;

Faces to_faces(const std::vector<Triangle>& triangles) {
  Faces faces(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    for (int corner = 0; corner < 3; ++corner) faces(f, corner) = triangles[f][corner];
  }
  return faces;
}

/// The lattice of the corners of nx x ny x nz cells.
struct Lattice {
  std::int64_t nx, ny, nz;

  std::int64_t corner(std::int64_t x, std::int64_t y, std::int64_t z) const {
    return x + (nx + 1) * (y + (ny + 1) * z);
  }
  Eigen::RowVector3d position(std::int64_t id) const {
    const std::int64_t row = id / (nx + 1), x = id % (nx + 1), y = row % (ny + 1), z = row / (ny + 1);
    return Eigen::RowVector3d(x, y, z);
  }
};

using Quad = std::array<std::int64_t, 4>;

/// The side of cell (x, y, z) that faces the far or the near end of `axis`, counter-clockwise seen from outside.
Quad cell_side(const Lattice& lattice, std::array<std::int64_t, 3> cell, int axis, bool far) {
  const int first = (axis + 1) % 3, second = (axis + 2) % 3;
  if (far) ++cell[axis];
  Quad quad;
  constexpr std::array<std::array<int, 2>, 4> kAround{{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
  for (int k = 0; k < 4; ++k) {
    std::array<std::int64_t, 3> corner = cell;
    corner[first] += kAround[k][far ? 0 : 1];
    corner[second] += kAround[k][far ? 1 : 0];
    quad[k] = lattice.corner(corner[0], corner[1], corner[2]);
  }
  return quad;
}

/// Makes a mesh of the quads. Its vertices are the lattice corners that a quad uses, in lattice order (x fastest).
TriangleMesh from_quads(const Lattice& lattice, const std::vector<Quad>& quads) {
  std::vector<std::int64_t> corners;
  corners.reserve(4 * quads.size());
  for (const Quad& quad : quads) corners.insert(corners.end(), quad.begin(), quad.end());
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  const auto index = [&](std::int64_t corner) {
    return static_cast<std::int32_t>(std::lower_bound(corners.begin(), corners.end(), corner) -
                                     corners.begin());
  };
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(corners.size()), 3);
  for (std::size_t v = 0; v < corners.size(); ++v) mesh.vertices.row(v) = lattice.position(corners[v]);
  std::vector<Triangle> triangles;
  for (const Quad& quad : quads) {
    triangles.push_back({index(quad[0]), index(quad[1]), index(quad[2])});
    triangles.push_back({index(quad[0]), index(quad[2]), index(quad[3])});
  }
  mesh.faces = to_faces(triangles);
  return mesh;
}

/// The boundary of the cells for which `is_solid(x, y, z)` is true. It is also called for cells outside the lattice.
template <typename Solid>
TriangleMesh solid_surface(const Lattice& lattice, const Solid& is_solid) {
  std::vector<Quad> quads;
  for (std::int64_t z = 0; z < lattice.nz; ++z) {
    for (std::int64_t y = 0; y < lattice.ny; ++y) {
      for (std::int64_t x = 0; x < lattice.nx; ++x) {
        if (!is_solid(x, y, z)) continue;
        const std::array<std::int64_t, 3> cell{x, y, z};
        for (int axis = 0; axis < 3; ++axis) {
          for (const bool far : {false, true}) {
            std::array<std::int64_t, 3> next = cell;
            next[axis] += far ? 1 : -1;
            if (!is_solid(next[0], next[1], next[2])) quads.push_back(cell_side(lattice, cell, axis, far));
          }
        }
      }
    }
  }
  return from_quads(lattice, quads);
}

TriangleMesh icosahedron() {
  const double g = std::numbers::phi;
  TriangleMesh mesh;
  mesh.vertices.resize(12, 3);
  mesh.vertices << -1, g, 0, 1, g, 0, -1, -g, 0, 1, -g, 0, 0, -1, g, 0, 1, g, 0, -1, -g, 0, 1, -g, g, 0, -1,
      g, 0, 1, -g, 0, -1, -g, 0, 1;
  mesh.vertices.rowwise().normalize();
  mesh.faces.resize(20, 3);
  mesh.faces << 0, 11, 5, 0, 5, 1, 0, 1, 7, 0, 7, 10, 0, 10, 11, 1, 5, 9, 5, 11, 4, 11, 10, 2, 10, 7, 6, 7, 1,
      8, 3, 9, 4, 3, 4, 2, 3, 2, 6, 3, 6, 8, 3, 8, 9, 4, 9, 5, 2, 4, 11, 6, 2, 10, 8, 6, 7, 9, 8, 1;
  return mesh;
}

/// Splits each face into four and projects the new vertices onto the sphere.
TriangleMesh subdivided(const TriangleMesh& mesh) {
  std::map<std::pair<std::int32_t, std::int32_t>, std::int32_t> middles;
  const auto old_count = static_cast<std::int32_t>(mesh.vertices.rows());
  const auto middle = [&](std::int32_t a, std::int32_t b) {
    const auto next = static_cast<std::int32_t>(old_count + middles.size());
    return middles.try_emplace({std::min(a, b), std::max(a, b)}, next).first->second;
  };
  std::vector<Triangle> triangles;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const std::int32_t a = mesh.faces(f, 0), b = mesh.faces(f, 1), c = mesh.faces(f, 2);
    const std::int32_t ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    triangles.insert(triangles.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
  }
  TriangleMesh finer;
  finer.faces = to_faces(triangles);
  finer.vertices.resize(old_count + static_cast<Eigen::Index>(middles.size()), 3);
  finer.vertices.topRows(old_count) = mesh.vertices;
  for (const auto& [edge, vertex] : middles) {
    finer.vertices.row(vertex) =
        (mesh.vertices.row(edge.first) + mesh.vertices.row(edge.second)).normalized();
  }
  return finer;
}

}  // namespace

TriangleMesh box_surface(int nx, int ny, int nz) {
  LPDEFORM_CHECK(nx >= 1 && ny >= 1 && nz >= 1);
  return solid_surface({nx, ny, nz}, [=](std::int64_t x, std::int64_t y, std::int64_t z) {
    return x >= 0 && x < nx && y >= 0 && y < ny && z >= 0 && z < nz;
  });
}

TriangleMesh grid(int nx, int ny, double bump) {
  LPDEFORM_CHECK(nx >= 1 && ny >= 1);
  constexpr double kBumps = 5;
  const auto wave = [](double t) { return std::pow(std::sin(kBumps * std::numbers::pi * t), 2); };
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(nx + 1) * (ny + 1), 3);
  mesh.faces.resize(static_cast<Eigen::Index>(nx) * ny * 2, 3);
  Eigen::Index vertex = 0, face = 0;
  for (int y = 0; y <= ny; ++y) {
    for (int x = 0; x <= nx; ++x) {
      const double height = bump == 0 ? 0 : bump * wave(double(x) / nx) * wave(double(y) / ny);
      mesh.vertices.row(vertex++) = Eigen::RowVector3d(x, y, height);
      if (x == nx || y == ny) continue;
      const std::int32_t a = y * (nx + 1) + x, b = a + 1, c = b + nx + 1, d = a + nx + 1;
      mesh.faces.row(face++) << a, b, c;
      mesh.faces.row(face++) << a, c, d;
    }
  }
  return mesh;
}

TriangleMesh block_with_holes(int nx, int ny, int nz) {
  LPDEFORM_CHECK(nx >= 7 && ny >= 3 && nz >= 1);
  const std::int64_t side = std::min(nx / 7, ny / 3), low_y = (ny - side) / 2;
  std::vector<bool> is_tunnel(nx, false);
  for (std::int64_t k = 0; k < 3; ++k) {
    const std::int64_t low_x = ((4 * k + 3) * nx - 7 * side) / 14;
    std::fill_n(is_tunnel.begin() + low_x, side, true);
  }
  return solid_surface({nx, ny, nz}, [&](std::int64_t x, std::int64_t y, std::int64_t z) {
    if (x < 0 || x >= nx || y < 0 || y >= ny || z < 0 || z >= nz) return false;
    return !(is_tunnel[x] && y >= low_y && y < low_y + side);
  });
}

TriangleMesh necked_bar(int side, int length, int neck_side, int neck_length) {
  LPDEFORM_CHECK(neck_side >= 1 && neck_side <= side && (side - neck_side) % 2 == 0);
  LPDEFORM_CHECK(neck_length >= 0 && neck_length < length);
  const std::int64_t margin = (side - neck_side) / 2, neck_begin = (length - neck_length) / 2;
  return solid_surface({side, side, length}, [=](std::int64_t x, std::int64_t y, std::int64_t z) {
    if (z < 0 || z >= length) return false;
    const std::int64_t inset = z >= neck_begin && z < neck_begin + neck_length ? margin : 0;
    return x >= inset && x < side - inset && y >= inset && y < side - inset;
  });
}

TriangleMesh sphere(int levels) {
  LPDEFORM_CHECK(levels >= 0);
  TriangleMesh mesh = icosahedron();
  for (int level = 0; level < levels; ++level) mesh = subdivided(mesh);
  return mesh;
}

}  // namespace lpdeform
