#include "python/settings.h"

#include <limits>

#include "dtsdf_mapping/io/yaml_params.h"
#include "python/arrays.h"

namespace dtsdf::python {
namespace {

namespace py = pybind11;

[[noreturn]] void refuseValue(const std::string& key, py::handle value) {
  throw py::type_error("the setting " + key + " must be a number, a bool or a string, not a " +
                       typeName(value));
}

int wholeNumberOf(const std::string& key, py::handle value) {
  int is_beyond = 0;
  const long long number = PyLong_AsLongLongAndOverflow(value.ptr(), &is_beyond);
  if (is_beyond != 0 || number < std::numeric_limits<int>::min() ||
      number > std::numeric_limits<int>::max()) {
    throw py::value_error("the setting " + key + " is out of range");
  }
  return static_cast<int>(number);
}

ParamValue valueOf(const std::string& key, py::handle value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>();
  if (py::isinstance<py::str>(value)) return value.cast<std::string>();
  if (typeName(value).rfind("numpy.bool", 0) == 0) return PyObject_IsTrue(value.ptr()) == 1;
  if (PyIndex_Check(value.ptr())) {
    return wholeNumberOf(key, py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr())));
  }
  if (PyNumber_Check(value.ptr())) {
    const double number = PyFloat_AsDouble(value.ptr());
    if (PyErr_Occurred() == nullptr) return number;
    PyErr_Clear();
  }
  refuseValue(key, value);
}

void addDict(const py::dict& settings, const std::string& section, ParamTree& tree) {
  for (const auto& [name, value] : settings) {
    if (!py::isinstance<py::str>(name)) {
      throw py::type_error("the keys of settings must be strings such as \"map/voxel_size_m\"");
    }
    const std::string key = section + name.cast<std::string>();
    if (py::isinstance<py::dict>(value)) {
      addDict(py::reinterpret_borrow<py::dict>(value), key + "/", tree);
    } else {
      tree[key] = valueOf(key, value);
    }
  }
}

}  // namespace

ParamTree settingsOf(const py::object& settings, const py::kwargs& keywords) {
  ParamTree tree;
  if (py::isinstance<py::dict>(settings)) {
    addDict(settings, "", tree);
  } else if (!settings.is_none()) {
    if (!py::isinstance<py::str>(settings) && !py::hasattr(settings, "__fspath__")) {
      throw py::type_error("settings must be a dict or the path of a YAML file, not a " +
                           typeName(settings));
    }
    tree = loadYamlParams(pathOf(settings));
  }
  addDict(keywords, "", tree);
  return tree;
}

py::dict dictOf(const ParamTree& tree) {
  py::dict result;
  for (const auto& [key, value] : tree) {
    result[py::str(key)] =
        std::visit([](const auto& v) -> py::object { return py::cast(v); }, value);
  }
  return result;
}

}  // namespace dtsdf::python
