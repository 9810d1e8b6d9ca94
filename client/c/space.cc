#include "client/c/space.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "client/c/arguments.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {
absl::StatusOr<Space> Space::of(const lpdeform_options& options) {
  absl::Status checked = check_enum("handedness", options.handedness, LPDEFORM_LEFT_HANDED);
  checked.Update(check_enum("up", options.up, LPDEFORM_Z_UP));
  checked.Update(check_enum("winding", options.winding, LPDEFORM_CLOCKWISE));
  if (!checked.ok()) return checked;
  if (!std::isfinite(options.units_per_metre) || options.units_per_metre < 0) {
    return make_fault({Reason::kUnitsOutOfRange, "units_per_metre", "0 <= units_per_metre"},
                      absl::StrCat("units_per_metre is ", options.units_per_metre, "."));
  }
  Space space;
  if (options.units_per_metre > 0) space.units_per_metre_ = options.units_per_metre;
  space.mirrors_ = options.handedness == LPDEFORM_LEFT_HANDED;
  if (options.up == LPDEFORM_Z_UP) {
    space.axis_ = {0, 2, 1};  // by itself, this swap of two axes changes the handedness
    if (!space.mirrors_) space.sign_[2] = -1;
  } else if (space.mirrors_) {
    space.sign_[0] = -1;
  }
  // Both coordinate systems describe the same object: a triangle that looks clockwise still does.
  const bool is_unity = space.mirrors_ && options.up == LPDEFORM_Y_UP;
  space.turns_triangles_ =
      options.winding == LPDEFORM_WINDING_USUAL ? is_unity : options.winding == LPDEFORM_CLOCKWISE;
  return space;
}

Vector Space::direction_to_server(const Vector& direction) const {
  Vector out;
  for (int k = 0; k < 3; ++k) out[k] = sign_[k] * direction[axis_[k]];
  return out;
}

Vector Space::direction_to_engine(const Vector& direction) const {
  Vector out;
  for (int k = 0; k < 3; ++k) out[axis_[k]] = sign_[k] * direction[k];
  return out;
}

Vector Space::point_to_server(const Vector& point) const {
  Vector out = direction_to_server(point);
  for (double& coordinate : out) coordinate /= units_per_metre_;
  return out;
}

Vector Space::point_to_engine(const Vector& point) const {
  Vector out = direction_to_engine(point);
  for (double& coordinate : out) coordinate *= units_per_metre_;
  return out;
}

Vector Space::rotation_axis_to_server(const Vector& axis) const {
  Vector out = direction_to_server(axis);
  if (mirrors_) {
    for (double& component : out) component = -component;
  }
  return out;
}

}  // namespace lpdeform::engine
