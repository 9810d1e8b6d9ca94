// Decoder: p and stiffness, and fields that are found in the geometry.

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/analysis/automatic_material.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/given/given.h"
#include "server/wire/decode.h"
#include "server/wire/decode_parts.h"
#include "server/wire/vectors.h"

namespace lpdeform {

absl::StatusOr<Field> Decoder::field(const v1::Field& message, std::string_view what, Field Material::*part) {
  if (message.value_case() == v1::Field::kUniform) return Field(Field::Constant(1, message.uniform()));
  if (message.value_case() == v1::Field::kAutomatic) {
    const double strength = message.automatic().strength();
    if (absl::Status status = check_strength(strength); !status.ok()) return status;
    if (features_ == nullptr) {
      return make_fault({Reason::kFieldMissing, std::string(what), ""},
                        absl::StrCat("The stored ", std::string(what), " has no values."));
    }
    return automatic_field(*features_, weld_, strength, part);
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
  if (absl::Status status = check_field_size(what, count, vertex_count_); !status.ok()) return status;
  Field field(static_cast<Eigen::Index>(count));
  unpack(*scalar, data->view, field);
  return field;
}

absl::Status Decoder::resize(const v1::Resize& message, Update& out) const {
  LPDEFORM_CHECK(features_ != nullptr);
  GivenResize given{decode_vector(message.scale())};
  if (message.has_origin()) given.origin = decode_vector(message.origin());
  if (message.has_x_axis() || message.has_y_axis())
    given.axes.emplace(decode_vector(message.x_axis()), decode_vector(message.y_axis()));
  return add_resize(*features_, weld_, given, out);
}

}  // namespace lpdeform
