#include "core/energy/intrinsic_delaunay.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/mesh/half_edges.h"

namespace lpdeform {
namespace {

constexpr double kSlack = 1e-5;           // relative to the mean edge length: see step 2
constexpr double kRounding = 1e-9;        // a cotangent sum above -kRounding is not negative
constexpr double kSmallestHeight = 1e-8;  // of a triangle, relative to its longest side
constexpr std::size_t kMostFlips = 20;    // per side

constexpr std::int32_t kNone = -1;

/// A side of a triangle of the cover. The sides of triangle f have the ids 3 f to 3 f + 2, in order.
struct Side {
  std::int32_t tail = kNone;    // the vertex that it starts from
  std::int32_t twin = kNone;    // the same edge, seen from the other triangle
  std::int32_t origin = kNone;  // the edge of the mesh that it comes from
  double length = 0;            // in units of the mean edge length
};

bool is_sound(const Faces& faces, Eigen::Index f) {
  return faces(f, 0) != faces(f, 1) && faces(f, 1) != faces(f, 2) && faces(f, 2) != faces(f, 0);
}

/// The cover's side for the side `id` of the mesh. Triangle f of the mesh is triangle 2 f in front and, with reversed
/// orientation, 2 f + 1 at the back.
std::int32_t cover_side(std::int32_t id, bool is_back) {
  const std::int32_t face = id / 3, k = id % 3;
  return is_back ? 6 * face + 5 - k : 6 * face + k;
}

/// Four times the area of a triangle with these sides, and never 0 (Kahan's formula).
double four_areas(double a, double b, double c) {
  if (a < b) std::swap(a, b);
  if (a < c) std::swap(a, c);
  if (b < c) std::swap(b, c);
  const double product = (a + (b + c)) * (c - (a - b)) * (c + (a - b)) * (a + (b - c));
  return std::max(std::sqrt(std::max(product, 0.0)), kSmallestHeight * a * a);
}

class Cover {
 public:
  explicit Cover(const TriangleMesh& mesh) : sides_(6 * mesh.faces.rows()) {
    const EdgeTable table(mesh.vertices.rows(), mesh.faces,
                          [&](Eigen::Index f) { return is_sound(mesh.faces, f); });
    table.for_edges([&](std::int32_t low, std::int32_t high, std::span<const HalfEdge> sides) {
      glue(mesh, low, high, sides);
    });
    const double mean = total_length_ / static_cast<double>(edges_.size());
    for (Side& side : sides_) side.length /= mean;
  }

  void fatten();
  void make_delaunay();
  IntrinsicDelaunay result() const;

 private:
  void glue(const TriangleMesh& mesh, std::int32_t low, std::int32_t high, std::span<const HalfEdge> sides);
  double opposite_cotangent(std::int32_t side) const;
  double cotangent_sum(std::int32_t side) const;
  void flip(std::int32_t side);

  std::vector<Side> sides_;
  std::vector<std::array<std::int32_t, 2>> edges_;  // of the mesh
  std::vector<bool> is_flipped_;                    // of `edges_`
  double total_length_ = 0;
};

/// Joins the triangles around an edge in a ring: each face is glued to the next by the copies that face each other.
void Cover::glue(const TriangleMesh& mesh, std::int32_t low, std::int32_t high,
                 std::span<const HalfEdge> sides) {
  const double length = (mesh.vertices.row(low) - mesh.vertices.row(high)).norm();
  const auto edge = static_cast<std::int32_t>(edges_.size());
  edges_.push_back({low, high});
  is_flipped_.push_back(false);
  total_length_ += length;
  const auto runs_upwards = [&](HalfEdge side) { return mesh.faces(side.id / 3, side.id % 3) == low; };
  for (std::size_t k = 0; k < sides.size(); ++k) {
    const HalfEdge here = sides[k], there = sides[(k + 1) % sides.size()];
    const std::int32_t up = cover_side(here.id, !runs_upwards(here));
    const std::int32_t down = cover_side(there.id, runs_upwards(there));
    sides_[up] = {low, down, edge, length};
    sides_[down] = {high, up, edge, length};
  }
}

void Cover::fatten() {
  double missing = 0;
  for (std::size_t s = 0; s < sides_.size(); s += 3) {
    if (sides_[s].twin == kNone) continue;
    const double a = sides_[s].length, b = sides_[s + 1].length, c = sides_[s + 2].length;
    missing = std::max(missing, kSlack - (a + b + c - 2 * std::max({a, b, c})));
  }
  for (Side& side : sides_) side.length += missing;
}

double Cover::opposite_cotangent(std::int32_t side) const {
  const std::int32_t next = next_corner(side);
  const double a = sides_[side].length, b = sides_[next].length, c = sides_[next_corner(next)].length;
  return (b * b + (c - a) * (c + a)) / four_areas(a, b, c);
}

double Cover::cotangent_sum(std::int32_t side) const {
  return opposite_cotangent(side) + opposite_cotangent(sides_[side].twin);
}

/// Replaces the triangles i j k and j i m by k m j and m k i.
void Cover::flip(std::int32_t ij) {
  const std::int32_t jk = next_corner(ij), ki = next_corner(jk);
  const std::int32_t ji = sides_[ij].twin, im = next_corner(ji), mj = next_corner(im);
  const double l = sides_[ij].length, l_ki = sides_[ki].length, l_jk = sides_[jk].length,
               l_im = sides_[im].length, l_mj = sides_[mj].length;
  // i is at the origin and j at (l, 0); k is above and m below.
  const double k_x = (l * l + (l_ki - l_jk) * (l_ki + l_jk)) / (2 * l),
               m_x = (l * l + (l_im - l_mj) * (l_im + l_mj)) / (2 * l),
               height = (four_areas(l, l_jk, l_ki) + four_areas(l, l_im, l_mj)) / (2 * l);

  const std::array<std::int32_t, 4> from{mj, jk, ki, im}, to{jk, ki, im, mj};
  std::array<Side, 4> moved;
  for (int n = 0; n < 4; ++n) {
    moved[n] = sides_[from[n]];
    const auto found = std::find(from.begin(), from.end(), moved[n].twin);
    if (found != from.end()) moved[n].twin = to[found - from.begin()];
  }
  for (int n = 0; n < 4; ++n) {
    sides_[to[n]] = moved[n];
    sides_[moved[n].twin].twin = to[n];
  }
  if (sides_[ij].origin != kNone) is_flipped_[sides_[ij].origin] = true;
  const double length = std::hypot(k_x - m_x, height);
  sides_[ij] = {sides_[im].tail, ji, kNone, length};
  sides_[ji] = {sides_[jk].tail, ij, kNone, length};
}

void Cover::make_delaunay() {
  std::vector<std::int32_t> waiting;
  for (std::size_t s = 0; s < sides_.size(); ++s) {
    if (sides_[s].twin > static_cast<std::int32_t>(s)) waiting.push_back(static_cast<std::int32_t>(s));
  }
  const std::size_t most = kMostFlips * sides_.size();
  for (std::size_t flips = 0; !waiting.empty() && flips < most;) {
    const std::int32_t side = waiting.back(), twin = sides_[side].twin;
    waiting.pop_back();
    // An edge with the same triangle on both sides cannot be flipped. It need not be: its two angles are equal and
    // acute.
    if (side / 3 == twin / 3 || cotangent_sum(side) >= -kRounding) continue;
    flip(side);
    ++flips;
    for (const std::int32_t turned : {side, twin}) {
      waiting.push_back(next_corner(turned));
      waiting.push_back(next_corner(next_corner(turned)));
    }
  }
}

IntrinsicDelaunay Cover::result() const {
  IntrinsicDelaunay result;
  for (std::size_t s = 0; s < sides_.size(); ++s) {
    const auto side = static_cast<std::int32_t>(s);
    const std::int32_t twin = sides_[s].twin;
    if (twin < side) continue;
    const std::int32_t u = sides_[s].tail, v = sides_[twin].tail;
    if (u == v) continue;
    const double sum = cotangent_sum(side);
    const bool is_rounding = sum < 0 && sum >= -kRounding;
    result.edges.push_back({{std::min(u, v), std::max(u, v)}, is_rounding ? 0.0 : sum / 4});
  }
  for (std::size_t edge = 0; edge < edges_.size(); ++edge) {
    if (is_flipped_[edge]) result.flipped.push_back(edges_[edge]);
  }
  return result;
}

}  // namespace

IntrinsicDelaunay intrinsic_delaunay(const TriangleMesh& mesh) {
  Cover cover(mesh);
  cover.fatten();
  cover.make_delaunay();
  IntrinsicDelaunay result = cover.result();
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (is_sound(mesh.faces, f)) continue;
    for (int k = 0; k < 3; ++k) {
      const std::int32_t u = mesh.faces(f, k), v = mesh.faces(f, (k + 1) % 3);
      if (u != v) result.edges.push_back({{std::min(u, v), std::max(u, v)}, 0.0});
    }
  }
  std::stable_sort(result.edges.begin(), result.edges.end(),
                   [](const WeightedEdge& l, const WeightedEdge& r) { return l.edge < r.edge; });
  return result;
}

}  // namespace lpdeform
