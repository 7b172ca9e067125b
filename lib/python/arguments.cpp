// What a call says whose arguments do not fit: pybind11 lists what would over many lines; here it is one sentence.

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "python/arrays.hpp"

namespace gradpsi::python {
namespace {

using Call = PyObject* (*)(PyObject* self, PyObject* arguments, PyObject* by_name);

Call dispatcher = nullptr;  // pybind11's, the same for all its functions

struct Parameter {
  std::string name, type;
  bool optional, by_name;  // without a default; after a *
};

/// A function as messages of pybind11 describe it.
struct Signature {
  std::string name;
  std::string text;  // "(cloud: gradpsi.Cloud, threads: int = 0)"
  std::vector<Parameter> parameters = {};
};

/// Where the bracket at `begin` closes, or the first comma within it before that.
std::size_t end_of_item(std::string_view text, std::size_t begin) {
  int depth = 0;
  bool quoted = false;
  for (std::size_t k = begin; k < text.size(); ++k) {
    if (text[k] == '\'') quoted = !quoted;
    if (quoted) continue;
    if (std::string_view("([{<").find(text[k]) != std::string_view::npos) ++depth;
    if (depth == 0 && (text[k] == ',' || text[k] == ')')) return k;
    if (std::string_view(")]}>").find(text[k]) != std::string_view::npos) --depth;
  }
  return text.size();
}

/// Of the message that pybind11 makes of a call that does not fit; without parameters if it is not one.
Signature signature(const std::string& message) {
  const std::size_t line = message.find("\n    1. "), open = message.find('(', line);
  if (message.find("(): incompatible ") == std::string::npos || open == std::string::npos ||
      message.find("\n    2. ") != std::string::npos)
    return {};
  std::string name =
      message.substr(line + 8, open - line - 8);  // of a class, whose constructor it is
  name = name.empty() ? message.substr(0, message.find('(')) : name.substr(name.rfind('.') + 1);
  Signature result{name, ""};
  bool by_name = false;
  std::size_t begin = open + 1, end = begin;
  for (; end < message.size() && message[end] != ')'; begin = end + 2) {
    end = end_of_item(message, begin);
    const std::string item = message.substr(begin, end - begin);
    const std::size_t type = item.find(": "), value = item.find(" = ");
    if (item == "*") by_name = true;
    if (type == std::string::npos) continue;
    result.parameters.push_back({item.substr(0, type), item.substr(type + 2, value - type - 2),
                                 value != std::string::npos, by_name});
  }
  result.text = message.substr(open, end + 1 - open);
  return result;
}

std::string listed(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t k = 0; k < names.size(); ++k)
    text += (k == 0 ? "" : k + 1 < names.size() ? ", " : " and ") + names[k];
  return text;
}

/// Whether a value is of that type, as far as its name tells.
bool fits(const py::handle value, const std::string& type) {
  const bool integer = PyIndex_Check(value.ptr());
  if (type == "int") return integer;
  if (type == "float") return integer || py::hasattr(value, "__float__");
  if (type == "str") return py::isinstance<py::str>(value);
  if (type == "bool") return PyBool_Check(value.ptr());
  if (type == "dict") return py::isinstance<py::dict>(value);
  if (type == "os.PathLike")
    return py::isinstance<py::str>(value) || py::hasattr(value, "__fspath__");
  if (type.starts_with("gradpsi."))
    return py::isinstance(value, py::module_::import("gradpsi").attr(type.substr(8).c_str()));
  return true;
}

/// What is wrong with a call.
std::string complaint(const Signature& function, const py::tuple& arguments,
                      const py::dict& by_name) {
  const std::string call = function.name + "()";
  const std::vector<Parameter>& parameters = function.parameters;
  const auto positions =
      static_cast<std::size_t>(std::ranges::count(parameters, false, &Parameter::by_name));
  if (arguments.size() > positions)
    return call + " takes " + std::to_string(positions) + " arguments without a name, not " +
           std::to_string(arguments.size());
  std::vector<std::string> missing;
  std::string wrong, names;
  std::size_t used = 0;
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    const auto& [name, type, optional, only_by_name] = parameters[k];
    names += (k == 0 ? "" : ", ") + name;
    const bool named = by_name.contains(name);
    used += named;
    if (named && k < arguments.size()) return call + " is given " + name + " twice";
    if (!named && k >= arguments.size()) {
      if (!optional) missing.push_back(name);
      continue;
    }
    const py::object value = named ? py::object(by_name[name.c_str()]) : arguments[k];
    if (wrong.empty() && !(optional && value.is_none()) && !fits(value, type))
      wrong = call + " wants " + name + " to be of type " + type + ", not " +
              std::string(py::str(py::type::of(value).attr("__name__")));
  }
  if (used < by_name.size())
    for (const auto& [name, value] : by_name)
      if (std::ranges::find(parameters, std::string(py::str(name)), &Parameter::name) ==
          parameters.end())
        return call + " has no argument " + std::string(py::str(name)) + "; valid: " + names;
  if (!missing.empty())
    return call + " is missing its argument" + (missing.size() > 1 ? "s " : " ") + listed(missing);
  return wrong.empty() ? call + " takes " + function.text + ", which these arguments are not"
                       : wrong;
}

/// Replaces the TypeError that pybind11 has set.
void explain(PyObject* arguments, PyObject* by_name) {
  py::error_already_set error;
  Signature function = signature(py::str(error.value()));
  if (function.text.empty()) return error.restore();
  auto given = py::reinterpret_borrow<py::tuple>(arguments);
  const bool method = !function.parameters.empty() && function.parameters[0].name == "self";
  const bool constructor = std::string(py::str(error.value())).starts_with("__init__");
  if (method && given.size() > 0) {
    function.parameters.erase(function.parameters.begin());
    const std::size_t end = end_of_item(function.text, 1);
    function.text.erase(1, end - 1 + (function.text[end] == ',' ? 2 : 0));
  }
  if ((method || constructor) && given.size() > 0)
    given = given[py::slice(1, static_cast<py::ssize_t>(given.size()), 1)];
  const py::dict named = by_name ? py::reinterpret_borrow<py::dict>(by_name) : py::dict();
  PyErr_SetString(PyExc_TypeError, complaint(function, given, named).c_str());
}

PyObject* call(PyObject* self, PyObject* arguments, PyObject* by_name) {
  PyObject* const result = dispatcher(self, arguments, by_name);
  if (result || !PyErr_ExceptionMatches(PyExc_TypeError)) return result;
  try {
    explain(arguments, by_name);
  } catch (py::error_already_set& error) {
    error.restore();
  }
  return nullptr;
}

/// What pybind11 has made of one of our functions; null for others.
PyMethodDef* definition(const py::handle thing) {
  const py::handle function = py::detail::get_function(thing);
  if (!function || !PyCFunction_Check(function.ptr())) return nullptr;
  PyMethodDef* const def = reinterpret_cast<PyCFunctionObject*>(function.ptr())->m_ml;
  return def->ml_flags == (METH_VARARGS | METH_KEYWORDS) ? def : nullptr;
}

Call called(const PyMethodDef& def) {
  return reinterpret_cast<Call>(reinterpret_cast<void (*)()>(def.ml_meth));
}

void explain_calls_of(const py::dict& members) {
  for (const auto& [name, thing] : members)
    if (PyMethodDef* const def = definition(thing); def && called(*def) == dispatcher)
      def->ml_meth = reinterpret_cast<PyCFunction>(reinterpret_cast<void (*)()>(&call));
}

}  // namespace

void explain_calls(py::module_& m) {
  const PyMethodDef* const def = definition(m.attr("schemes"));
  if (!def) return;  // a pybind11 that calls functions in another way
  dispatcher = called(*def);
  const py::dict members = m.attr("__dict__");
  explain_calls_of(members);
  for (const auto& [name, thing] : members)
    if (py::isinstance<py::type>(thing)) explain_calls_of(py::dict(thing.attr("__dict__")));
}

}  // namespace gradpsi::python
