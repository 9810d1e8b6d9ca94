#include "core/energy/material.h"

#include <cmath>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

absl::Status check_field(const Field& field, std::int32_t vertex_count, const std::string& name,
                         double lowest, double highest, Reason reason) {
  if (field.size() != 1 && field.size() != vertex_count)
    return wrong_field_size(name, field.size(), vertex_count);
  for (Eigen::Index i = 0; i < field.size(); ++i) {
    if (field[i] >= lowest && field[i] <= highest) continue;
    const std::string element = field.size() == 1 ? name : absl::StrCat(name, "[", i, "]");
    const std::string limit = absl::StrCat(lowest, " <= ", name, " <= ", highest);
    return make_fault({reason, element, limit}, absl::StrCat(element, " is ", exact(field[i]),
                                                             "; it must be from ", lowest, " to ", highest));
  }
  return absl::OkStatus();
}

}  // namespace

Material Material::uniform(double p) {
  Material material;
  material.p = Field::Constant(1, p);
  return material;
}

bool Material::has_uniform_p() const {
  return p.size() == 0 || (p.array() == p[0]).all();
}

bool Material::operator==(const Material& other) const {
  const auto equal = [](const Field& a, const Field& b) { return a.size() == b.size() && a == b; };
  return equal(p, other.p) && equal(stiffness, other.stiffness) && length_unit == other.length_unit;
}

absl::Status wrong_field_size(std::string_view name, std::int64_t values, std::int64_t vertex_count) {
  const std::string field(name);
  return make_fault({Reason::kFieldSize, field, absl::StrCat("1 or ", vertex_count, " values")},
                    absl::StrCat(field, " has ", values, " values; it takes one, or one for each of the ",
                                 vertex_count, " vertices"));
}

absl::Status check_material(const Material& material, std::int32_t vertex_count) {
  if (auto status = check_field(material.p, vertex_count, "p", Material::kLowestP, Material::kHighestP,
                                Reason::kPOutOfRange);
      !status.ok()) {
    return status;
  }
  if (auto status = check_field(material.stiffness, vertex_count, "stiffness", Material::kLowestStiffness,
                                Material::kHighestStiffness, Reason::kStiffnessOutOfRange);
      !status.ok()) {
    return status;
  }
  if (!(material.length_unit >= 0) || !std::isfinite(material.length_unit)) {
    return make_fault({Reason::kLengthUnitOutOfRange, "length_unit", "0 <= length_unit < infinity"},
                      absl::StrCat("length_unit is ", material.length_unit,
                                   "; it must be 0 (the mean rest edge length) or a positive length"));
  }
  return absl::OkStatus();
}

}  // namespace lpdeform
