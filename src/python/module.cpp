/// dtsdf_mapping._core: binds the public library for the Python package.
#include "python/module.h"

#include <string>

#include "dtsdf_mapping/io/mesh_file.h"
#include "dtsdf_mapping/mapper.h"

namespace py = pybind11;

namespace {

/// Refuses numpy 2, whose arrays pybind11 before 2.12 cannot read.
void checkNumpy() {
#if PYBIND11_VERSION_HEX < 0x020C0000
  const auto version = py::module::import("numpy").attr("__version__").cast<std::string>();
  if (version.compare(0, 2, "1.") == 0) return;
  throw py::import_error(
      "dtsdf_mapping was built with pybind11 before 2.12, which cannot read arrays from numpy " +
      version + ": install numpy<2, or build with a newer pybind11");
#endif
}

}  // namespace

PYBIND11_MODULE(_core, m) {
  checkNumpy();
  m.attr("__version__") = DTSDF_VERSION;
  m.doc() = "The compiled part of dtsdf_mapping; import dtsdf_mapping instead.";
  // NOLINTNEXTLINE(performance-unnecessary-value-param): pybind11 gives the type
  py::register_exception_translator([](std::exception_ptr pointer) {
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const dtsdf::ParamError& error) {
      PyErr_SetString(PyExc_ValueError, error.what());
    }
  });
  dtsdf::python::bindRegions(m);
  dtsdf::python::bindMesh(m);
  dtsdf::python::bindBlocks(m);
  dtsdf::python::bindSpace(m);
  dtsdf::python::bindMapper(m);
  dtsdf::python::bindRecording(m);
  m.def("cuda_unavailable_reason", &dtsdf::cudaUnavailableReason,
        "Empty if a mapper with backend \"cuda\" can be created here, else the reason why not.");
}
