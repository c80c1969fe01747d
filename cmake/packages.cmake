# Debian packages, built by `tools/build packages` (CPack): doppel, libdoppel0, libdoppel-dev, doppel-data and, where
# pybind11 is installed, python3-doppel.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT "doppel's developers <doppel@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "Digital twin of a robot arm from its description")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_OUTPUT_FILE_PREFIX ${PROJECT_BINARY_DIR}/packages)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)  # the program's own library
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_COMPONENTS_ALL program library development data)

set(this_version "${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}")
set(abi ${PROJECT_VERSION_MAJOR})

set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME doppel)
set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "Turns a robot description (URDF, xacro) into a digital twin that moves under
 real physics and ros2_control's controllers, is seen in the browser, and is on
 ROS 2's network without ROS installed.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS "libdoppel${abi} (= ${this_version}), doppel-data (= ${this_version})")
# Launch files are read by Python.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "python3, python3-yaml")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)

set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libdoppel${abi})
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "The shared library of doppel with its physics engines and its ROS 2 network.")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_LIST_DIR}/debian/triggers)

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libdoppel-dev)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "Headers, CMake package and pkg-config file for programs and plug-ins that use doppel.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "libdoppel${abi} (= ${this_version}), libeigen3-dev, libfmt-dev")

set(CPACK_DEBIAN_DATA_PACKAGE_NAME doppel-data)
set(CPACK_COMPONENT_DATA_DESCRIPTION "Robots, worlds, datasheets and the page of doppel.")
set(CPACK_DEBIAN_DATA_PACKAGE_ARCHITECTURE all)

# The extension modules are for the interpreter's version that they are built with, as those of Debian's own packages.
if(TARGET _doppel)
  list(APPEND CPACK_COMPONENTS_ALL python)
  get_property(python GLOBAL PROPERTY DOPPEL_PYTHON)
  list(GET python 0 python_version)
  list(GET python 1 next_python_version)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-doppel)
  set(CPACK_COMPONENT_PYTHON_DESCRIPTION "The package doppel of Python: models of robots and their twins with NumPy arrays.")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "libdoppel${abi} (= ${this_version}), doppel-data (= ${this_version}), \
python3 (>= ${python_version}), python3 (<< ${next_python_version}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS python3-yaml)  # doppel.envs reads YAML with it
endif()
include(CPack)
