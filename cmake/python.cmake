# Installs the Python package dtsdf_mapping, with the module _core if that can be built. With
# catkin, the package also contains the messages, so it is installed even without _core.
if(NOT WITH_PYTHON MATCHES "^(AUTO|ON|OFF)$")
  message(FATAL_ERROR "WITH_PYTHON=${WITH_PYTHON}, but it must be AUTO, ON or OFF")
endif()

set(DTSDF_PYTHON OFF)
# Python can load a module built with a sanitizer only if Python itself was built with the same one.
if(WITH_PYTHON STREQUAL "OFF")
  set(python_state "disabled")
elseif(WITH_SANITIZER OR WITH_FUZZERS)
  set(python_state "not built with a sanitizer")
else()
  # catkin and pip set PYTHON_EXECUTABLE. find_package(Python3) would set only some of the variables
  # that pybind11 reads.
  if(PYTHON_EXECUTABLE)
    set(DTSDF_PYTHON_EXECUTABLE ${PYTHON_EXECUTABLE})
  else()
    find_program(DTSDF_PYTHON3 python3)
    set(DTSDF_PYTHON_EXECUTABLE ${DTSDF_PYTHON3})
    set(PYTHON_EXECUTABLE ${DTSDF_PYTHON3})
  endif()
  # Used instead of pybind11's own search, as other ROS packages have already run parts of the CMake
  # modules that this search relies on.
  set(python_includes)
  set(numpy_missing 1)
  if(DTSDF_PYTHON_EXECUTABLE)
    execute_process(COMMAND ${DTSDF_PYTHON_EXECUTABLE} -c "import os, sysconfig
folder = sysconfig.get_paths()['include']
print(folder if os.path.exists(folder + '/Python.h') else '', end='')"
                    OUTPUT_VARIABLE python_includes ERROR_QUIET)
    execute_process(COMMAND ${DTSDF_PYTHON_EXECUTABLE} -c
                            "import sysconfig; print(sysconfig.get_config_var('EXT_SUFFIX'), end='')"
                    OUTPUT_VARIABLE DTSDF_PYTHON_SUFFIX ERROR_QUIET)
    execute_process(COMMAND ${DTSDF_PYTHON_EXECUTABLE} -c "import numpy" RESULT_VARIABLE numpy_missing
                    OUTPUT_QUIET ERROR_QUIET)
  endif()
  if(python_includes)
    set(PYBIND11_NOPYTHON ON)  # only its headers are needed
    find_package(pybind11 QUIET CONFIG)
  endif()
  set(python_state)
  # pip may build in an environment without numpy, which is needed only at run time.
  if(pybind11_FOUND AND (SKBUILD OR numpy_missing EQUAL 0))
    set(DTSDF_PYTHON ON)
    set(DTSDF_PYTHON_INCLUDES ${python_includes} ${pybind11_INCLUDE_DIR} ${pybind11_INCLUDE_DIRS})
  elseif(NOT DTSDF_PYTHON_EXECUTABLE)
    set(python_state "python3")
  elseif(NOT python_includes)
    set(python_state "Python.h for ${DTSDF_PYTHON_EXECUTABLE} (python3-dev)")
  elseif(NOT pybind11_FOUND)
    set(python_state "pybind11 (pybind11-dev)")
  else()
    set(python_state "numpy for ${DTSDF_PYTHON_EXECUTABLE} (python3-numpy)")
  endif()
  if(python_state)
    set(python_state "missing ${python_state}")
  else()
    set(python_state "for ${DTSDF_PYTHON_EXECUTABLE}")
  endif()
endif()
if(WITH_PYTHON STREQUAL "ON" AND NOT DTSDF_PYTHON)
  message(FATAL_ERROR "WITH_PYTHON=ON, but the Python module cannot be built (${python_state}): install "
                      "what is missing, choose another Python with -DPYTHON_EXECUTABLE=/usr/bin/python3, or "
                      "build with WITH_PYTHON=OFF.")
endif()
message(STATUS "dtsdf_mapping: Python module ${DTSDF_PYTHON} (WITH_PYTHON=${WITH_PYTHON}; ${python_state})")

# Build and installation folders of the package.
if(SKBUILD)
  set(DTSDF_PYTHON_BUILD ${PROJECT_BINARY_DIR}/python/dtsdf_mapping)
  set(python_dir dtsdf_mapping)
elseif(WITH_ROS)
  set(DTSDF_PYTHON_BUILD ${CATKIN_DEVEL_PREFIX}/${CATKIN_PACKAGE_PYTHON_DESTINATION})
  set(python_dir ${CATKIN_PACKAGE_PYTHON_DESTINATION})
else()
  set(DTSDF_PYTHON_BUILD ${PROJECT_BINARY_DIR}/python/dtsdf_mapping)
  set(DTSDF_PYTHON_DIR lib/python3/dist-packages CACHE STRING
      "Folder under the prefix in which the Python package is installed")
  set(python_dir ${DTSDF_PYTHON_DIR}/dtsdf_mapping)
endif()

if(DTSDF_PYTHON OR WITH_ROS)
  file(GLOB python_files CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/python/dtsdf_mapping/*.py
       ${PROJECT_SOURCE_DIR}/python/dtsdf_mapping/*.pyi
       ${PROJECT_SOURCE_DIR}/python/dtsdf_mapping/py.typed)
  # With catkin this replaces the empty __init__.py of the messages.
  file(MAKE_DIRECTORY ${DTSDF_PYTHON_BUILD})
  foreach(file ${python_files})
    get_filename_component(name ${file} NAME)
    configure_file(${file} ${DTSDF_PYTHON_BUILD}/${name} COPYONLY)
  endforeach()
  install(FILES ${python_files} DESTINATION ${python_dir} COMPONENT python)
endif()
if(DTSDF_PYTHON)
  add_subdirectory(src/python)
  install(TARGETS _core LIBRARY DESTINATION ${python_dir} COMPONENT python)
endif()
