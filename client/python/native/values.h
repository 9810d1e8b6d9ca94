#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/string_view.h>

#include <memory>

#include "absl/status/statusor.h"
#include "core/base/geometry.h"
#include "core/energy/weights.h"
#include "core/solve/deformer.h"
#include "server/given/given.h"
#include "server/session/session.h"

namespace lpdeform::python {

namespace nb = nanobind;

/// An error of the core on its way to Python, where it becomes an LpdeformError.
struct Refused {
  absl::Status status;
};

inline void require(const absl::Status& status) {
  if (!status.ok()) throw Refused{status};
}

template <typename Value>
Value required(absl::StatusOr<Value> value) {
  require(value.status());
  return *std::move(value);
}

/// The LpdeformError of a status.
nb::object error_of(const absl::Status& status);

using Numbers3 = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Indices = nb::ndarray<const std::uint32_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Indices3 = nb::ndarray<const std::uint32_t, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;

Points points_of(const Numbers3& numbers);

/// Vertices and faces as they were given. An index over 2^31 - 1 becomes 2^31 - 1, which no mesh has.
TriangleMesh mesh_of(const Numbers3& vertices, const Indices3& faces);

/// None: null. A float: by position, within that share of the diagonal. An array: one number per vertex, the same for copies.
std::shared_ptr<const Weld> weld_of(nb::handle weld, const Points& positions);

WeightKind weights_of(std::string_view name);
FreeComponents free_components_of(std::string_view name);

/// The values of lpdeform.types.Update and Settings, checked and copied by lpdeform._checks.
Update update_of(nb::handle update, std::uint64_t input_seq, const Session& session);
SettingsChange settings_of(nb::handle settings, std::uint32_t vertex_count, const ShapeFeatures& features,
                           const Weld* weld);

/// The fields of lpdeform.frames.FrameOptions.
StreamOptions stream_options_of(nb::handle options);

}  // namespace lpdeform::python
