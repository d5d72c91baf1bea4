/// The parts of the module dtsdf_mapping._core.
#pragma once

#include <pybind11/pybind11.h>

namespace dtsdf::python {

void bindRegions(pybind11::module& m);
void bindMesh(pybind11::module& m);
void bindBlocks(pybind11::module& m);
void bindSpace(pybind11::module& m);
void bindMapper(pybind11::module& m);
void bindRecording(pybind11::module& m);

}  // namespace dtsdf::python
