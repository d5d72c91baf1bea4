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

/// Makes pickling and copying a class fail, with an error that says what to do instead.
template <class Class>
void refusePickle(Class& bound, const char* name, const char* instead) {
  const std::string text = std::string("a ") + name + " cannot be pickled or copied: " + instead;
  bound.def("__reduce_ex__", [text](pybind11::handle, int) -> pybind11::object {
    throw pybind11::type_error(text);
  });
}

}  // namespace dtsdf::python
