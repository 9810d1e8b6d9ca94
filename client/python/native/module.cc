// lpdeform._core: sessions in this process, for lpdeform/_local.py, and mesh files, for lpdeform/mesh_files.py.

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/unique_ptr.h>

#include "client/python/native/mesh_file.h"
#include "client/python/native/session.h"

namespace {

using namespace lpdeform::python;  // NOLINT(google-build-using-namespace): the module is these names
namespace nb = nanobind;

void raise(const std::exception_ptr& thrown, void*) {
  try {
    std::rethrow_exception(thrown);
  } catch (const Refused& refused) {
    const nb::object error = error_of(refused.status);
    PyErr_SetObject(error.type().ptr(), error.ptr());
  }
}

}  // namespace

NB_MODULE(_core, module) {
  nb::set_leak_warnings(false);  // a daemon thread, or the child of a fork, may end with the process
  nb::register_exception_translator(raise);
  nb::class_<LocalStream>(module, "Stream")
      .def("next", &LocalStream::next)
      .def("acknowledge", &LocalStream::acknowledge, nb::call_guard<nb::gil_scoped_release>())
      .def("stop", &LocalStream::stop);
  nb::class_<LocalJob>(module, "Job")
      .def("wait", &LocalJob::wait)
      .def("progress", &LocalJob::progress)
      .def("result", &LocalJob::result)
      .def("abandon", &LocalJob::abandon);
  nb::class_<LocalSession>(module, "Session", nb::is_weak_referenceable())
      .def_prop_ro("name", &LocalSession::name)
      .def_prop_ro("is_closed", &LocalSession::is_closed)
      .def("report", &LocalSession::report)
      .def("lease", &LocalSession::lease)
      .def("acquire_writer", &LocalSession::acquire_writer)
      .def("update", &LocalSession::update)
      .def("undo", &LocalSession::undo)
      .def("take_better", &LocalSession::take_better)
      .def("solve", &LocalSession::solve, nb::arg("token"), nb::arg("certify"), nb::arg("trace"),
           nb::arg("positions").none(), nb::arg("progress"))
      .def("open_stream", &LocalSession::open_stream)
      .def("forget_stream", &LocalSession::forget_stream, nb::call_guard<nb::gil_scoped_release>())
      .def("close", &LocalSession::close, nb::call_guard<nb::gil_scoped_release>());
  module.def("create", &LocalSession::create, nb::arg("vertices"), nb::arg("faces"),
             nb::arg("normals").none(), nb::arg("weld").none(), nb::arg("weights"),
             nb::arg("free_components"), nb::arg("settings"));
  nb::class_<LocalMeshFile>(module, "MeshFile")
      .def("vertices", &LocalMeshFile::vertices)
      .def("faces", &LocalMeshFile::faces)
      .def_prop_ro("splits_vertices", &LocalMeshFile::splits_vertices)
      .def("groups", &LocalMeshFile::groups)
      .def("parts", &LocalMeshFile::parts)
      .def("notices", &LocalMeshFile::notices)
      .def("write", &LocalMeshFile::write, nb::arg("path"), nb::arg("positions"), nb::arg("adds_normals"),
           nb::arg("weld").none());
  module.def("read_mesh_file", &read_mesh_file);
  module.def("write_mesh_file", &write_mesh_file);
  module.def("end_threads", &end_threads);
  module.def("forget_threads", &forget_threads);
}
