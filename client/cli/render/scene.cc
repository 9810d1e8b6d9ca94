#include "client/cli/render/scene.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "client/cli/render/corner_normals.h"
#include "client/cli/render/shading.h"

namespace lpdeform {
namespace {

constexpr Rgb kPlain{196, 190, 180};

Points at_corners(const Faces& faces, const Points& positions) {
  Points corners(3 * faces.rows(), 3);
  for (Eigen::Index corner = 0; corner < corners.rows(); ++corner) {
    corners.row(corner) = positions.row(faces(corner / 3, corner % 3));
  }
  return corners;
}

Field at_corners(const Faces& faces, const Field& heat) {
  Field corners(heat.size() > 0 ? 3 * faces.rows() : 0);
  for (Eigen::Index corner = 0; corner < corners.size(); ++corner) {
    corners[corner] = heat[faces(corner / 3, corner % 3)];
  }
  return corners;
}

Points at_corners(const Faces& faces, const std::vector<Rgb>& colours) {
  Points corners(colours.empty() ? 0 : 3 * faces.rows(), 3);
  for (Eigen::Index corner = 0; corner < corners.rows(); ++corner) {
    const Rgb& colour = colours[faces(corner / 3, corner % 3)];
    corners.row(corner) << colour[0], colour[1], colour[2];
  }
  return corners;
}

}  // namespace

Scene::Scene(const Surface& surface, Camera camera, int width, int height)
    : corners_(at_corners(surface.faces, surface.positions)),
      normals_(corner_normals(surface.positions, surface.faces)),
      heat_(at_corners(surface.faces, surface.heat)),
      colours_(at_corners(surface.faces, surface.colours)),
      camera_(std::move(camera)),
      raster_(width, height) {
  for (Eigen::Index first = 0; first < corners_.rows(); first += 3) {
    raster_.draw(static_cast<std::int32_t>(first / 3),
                 {camera_.project(corners_.row(first)), camera_.project(corners_.row(first + 1)),
                  camera_.project(corners_.row(first + 2))});
  }
}

Scene::Scene(const Faces& faces, const Points& positions, const Field& heat, int width, int height)
    : Scene({faces, positions, heat, {}}, Camera(at_corners(faces, positions), width, height), width,
            height) {}

Eigen::RowVector3d Scene::normal_towards_camera(const Raster::Sample& sample) const {
  const Eigen::RowVector3d normal = inside(normals_, sample).normalized();
  const bool is_away = camera_.turn(normal).dot(camera_.towards_camera(inside(corners_, sample))) < 0;
  return is_away ? -normal : normal;
}

Rgb Scene::albedo_at(const Raster::Sample& sample) const {
  if (heat_.size() > 0) {
    const Eigen::Index first = 3 * Eigen::Index{sample.face};
    return blue_to_red((1 - sample.b - sample.c) * heat_[first] + sample.b * heat_[first + 1] +
                       sample.c * heat_[first + 2]);
  }
  if (colours_.rows() == 0) return kPlain;
  const Eigen::RowVector3d mixed = inside(colours_, sample);
  Rgb colour;
  for (int channel = 0; channel < 3; ++channel) {
    colour[channel] = static_cast<std::uint8_t>(std::lround(std::clamp(mixed[channel], 0.0, 255.0)));
  }
  return colour;
}

Rgb Scene::colour_at(int x, int y, double openness) const {
  const Raster::Sample& sample = raster_.at(x, y);
  if (sample.face < 0) return background((y + 0.5) / raster_.height());
  return shaded(albedo_at(sample), camera_.turn(normal_towards_camera(sample)),
                camera_.towards_camera(inside(corners_, sample)), openness);
}

bool Scene::is_one_face(int x, int y, int side) const {
  const std::int32_t face = raster_.at(x, y).face;
  for (int k = 1; k < side * side; ++k) {
    if (raster_.at(x + k % side, y + k / side).face != face) return false;
  }
  return true;
}

double Scene::diagonal() const {
  return (corners_.colwise().maxCoeff() - corners_.colwise().minCoeff()).norm();
}

Eigen::RowVector3d Scene::point_at(int x, int y) const {
  const Raster::Sample& sample = raster_.at(x, y);
  if (sample.face < 0) return Eigen::RowVector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  return inside(corners_, sample);
}

}  // namespace lpdeform
