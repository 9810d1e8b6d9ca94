#include "core/io/readers.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

std::string with_capital(std::string_view text) {
  std::string result(text);
  if (!result.empty() && result[0] >= 'a' && result[0] <= 'z') result[0] += 'A' - 'a';
  return result;
}

absl::string_view view(std::string_view text) {
  return {text.data(), text.size()};
}

}  // namespace

absl::Status mesh_syntax(std::string_view where, std::string_view what) {
  return make_fault({Reason::kMeshSyntax, std::string(where), ""},
                    absl::StrCat(with_capital(where), ": ", view(what), "."));
}

bool are_finite(double x, double y, double z) {
  return std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
}

void MeshBuilder::reserve(std::int64_t vertices, std::int64_t faces, std::size_t bytes_left) {
  constexpr std::size_t kFewestBytesAnElement = 6;
  const auto most = static_cast<std::int64_t>(bytes_left / kFewestBytesAnElement);
  coordinates_.reserve(3 * std::clamp<std::int64_t>(vertices, 0, most));
  corners_.reserve(3 * std::clamp<std::int64_t>(faces, 0, most));
}

void MeshBuilder::add_polygon(std::span<const std::int32_t> corners) {
  for (std::size_t k = 2; k < corners.size(); ++k) {
    corners_.insert(corners_.end(), {corners[0], corners[k - 1], corners[k]});
  }
}

TriangleMesh MeshBuilder::mesh() const {
  const auto faces = static_cast<Eigen::Index>(corners_.size() / 3);
  return {Eigen::Map<const Points>(coordinates_.data(), vertices(), 3),
          Eigen::Map<const Faces>(corners_.data(), faces, 3)};
}

}  // namespace lpdeform
