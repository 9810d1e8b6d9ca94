// Decoder: p and stiffness, and fields that are found in the geometry.

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/analysis/automatic_material.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/resize/resize.h"
#include "server/wire/decode.h"
#include "server/wire/decode_parts.h"
#include "server/wire/vectors.h"

namespace lpdeform {

/// Converts a field found on the welded shape to the client's vertices.
Field Decoder::for_client(Field found) const {
  return weld_ == nullptr || found.size() == 1 ? std::move(found) : scattered(found, *weld_);
}

absl::StatusOr<Field> Decoder::field(const v1::Field& message, std::string_view what, Field Material::*part) {
  if (message.value_case() == v1::Field::kUniform) return Field(Field::Constant(1, message.uniform()));
  if (message.value_case() == v1::Field::kAutomatic) {
    const double strength = message.automatic().strength();
    if (absl::Status status = check_strength(strength); !status.ok()) return status;
    if (features_ == nullptr) {
      return make_fault({Reason::kFieldMissing, std::string(what), ""},
                        absl::StrCat("The stored ", std::string(what), " has no values."));
    }
    const auto material = automatic_material(features_->joint(), strength);
    return for_client(*material.*part);
  }
  if (message.value_case() != v1::Field::kPerVertex) {
    return make_fault({Reason::kFieldMissing, std::string(what), ""},
                      absl::StrCat("The ", std::string(what), " has no value."));
  }
  const auto scalar = decode_scalar(message.per_vertex().scalar());
  if (!scalar.ok()) return scalar.status();
  const auto data = bytes(message.per_vertex().values(), what);
  if (!data.ok()) return data.status();
  if (data->view.size() % bytes_of(*scalar) != 0) {
    return wrong_size(what, data->view.size(), absl::StrCat("a multiple of ", bytes_of(*scalar)));
  }
  const std::size_t count = data->view.size() / bytes_of(*scalar);
  if (count != 1 && count != vertex_count_)
    return wrong_field_size(what, static_cast<std::int64_t>(count), vertex_count_);
  Field field(static_cast<Eigen::Index>(count));
  unpack(*scalar, data->view, field);
  return field;
}

absl::Status Decoder::resize(const v1::Resize& message, Update& out) const {
  LPDEFORM_CHECK(features_ != nullptr);
  Scaling scaling;
  scaling.scale = decode_vector(message.scale());
  scaling.origin = message.has_origin() ? decode_vector(message.origin()) : box_middle(features_->shape());
  if (message.has_x_axis() || message.has_y_axis()) {
    const auto axes = axes_of(decode_vector(message.x_axis()), decode_vector(message.y_axis()));
    if (!axes.ok()) return axes.status();
    scaling.axes = *axes;
  }
  auto inputs = resize_inputs(*features_, scaling);
  if (!inputs.ok()) return inputs.status();
  if (weld_ != nullptr) {
    for (std::int32_t& vertex : inputs->handle.vertices)
      vertex = weld_->first_copy[vertex];  // holds all copies
  }
  out.handles.push_back({"resize", std::move(inputs->handle)});
  if (!out.settings.p) out.settings.p = for_client(std::move(inputs->material.p));
  if (!out.settings.stiffness) out.settings.stiffness = for_client(std::move(inputs->material.stiffness));
  return absl::OkStatus();
}

}  // namespace lpdeform
