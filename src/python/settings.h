/// Settings of a mapper as Python gives them: a dict, flat or nested, or the path of a YAML file.
#pragma once

#include <pybind11/pybind11.h>

#include "dtsdf_mapping/params/param_set.h"

namespace dtsdf::python {

/// A flat tree of what `settings` (None, a dict or a path) and then `keywords` give.
/// @throws py::type_error for other things, std::runtime_error for a file that is not YAML.
ParamTree settingsOf(const pybind11::object& settings, const pybind11::kwargs& keywords);

/// The same as a dict.
pybind11::dict dictOf(const ParamTree& tree);

}  // namespace dtsdf::python
