# All modules as two shared libraries, for the program `doppel`, for other programs and for plug-ins: libdoppel.so has what a
# running twin needs (session/live and all that it uses), libdoppel_tools.so the other modules, so that the first start of
# a twin does not wait for them. Tests link the modules themselves, because they use hidden functions.
include_guard()

foreach(package yaml-cpp nlohmann_json Boost Qhull)  # the results of the modules' find_package are local to their folders
  find_package(${package} REQUIRED)
endforeach()

set(modules_of_twin)
set(open live launch)
while(open)
  list(POP_FRONT open module)
  if(NOT module IN_LIST modules_of_twin)
    list(APPEND modules_of_twin ${module})
    get_target_property(below doppel_${module} DOPPEL_USES)
    list(APPEND open ${below})
  endif()
endwhile()
get_property(other_modules GLOBAL PROPERTY DOPPEL_MODULES)
list(REMOVE_ITEM other_modules ${modules_of_twin})

# doppel_shared_library(TARGET NAME MODULES...): lib<NAME>.so
function(doppel_shared_library target name)
  add_library(${target} SHARED)
  set(borrowed)
  foreach(module IN LISTS ARGN)
    target_sources(${target} PRIVATE $<TARGET_OBJECTS:doppel_${module}>)
    get_target_property(libraries doppel_${module} DOPPEL_BORROWED)
    list(APPEND borrowed ${libraries})
  endforeach()
  list(REMOVE_DUPLICATES borrowed)
  set_target_properties(${target} PROPERTIES OUTPUT_NAME ${name} LINKER_LANGUAGE CXX VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR} LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib INSTALL_RPATH "$ORIGIN")
  target_compile_options(${target} PRIVATE $<TARGET_PROPERTY:doppel_flags,INTERFACE_COMPILE_OPTIONS>)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
    $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>
    $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_link_libraries(${target} INTERFACE Eigen3::Eigen fmt::fmt Threads::Threads PRIVATE ${borrowed})
  target_link_options(${target} PRIVATE LINKER:-Bsymbolic-functions LINKER:--no-undefined
    $<TARGET_PROPERTY:doppel_flags,INTERFACE_LINK_OPTIONS>)
endfunction()

doppel_shared_library(doppel_library doppel ${modules_of_twin})
target_sources(doppel_library PRIVATE ${PROJECT_SOURCE_DIR}/src/doppel/version.cpp)
target_compile_definitions(doppel_library PRIVATE DOPPEL_VERSION="${PROJECT_VERSION}")
set_target_properties(doppel_library PROPERTIES EXPORT_NAME doppel)
add_library(doppel::doppel ALIAS doppel_library)
get_property(plugin_modules GLOBAL PROPERTY DOPPEL_PLUGIN_MODULES)
list(FILTER plugin_modules EXCLUDE REGEX "^doppel_engine_|_avx[0-9]+$")
add_dependencies(doppel_library ${plugin_modules})

doppel_shared_library(doppel_tools_library doppel_tools ${other_modules})
target_link_libraries(doppel_tools_library PUBLIC doppel_library)
set_target_properties(doppel_tools_library PROPERTIES EXPORT_NAME tools)
add_library(doppel::tools ALIAS doppel_tools_library)
# The floors with a module in it, for doppelConfig.cmake.
set(DOPPEL_FLOORS_OF_TOOLS)
foreach(module IN LISTS other_modules)
  get_target_property(folder doppel_${module} SOURCE_DIR)
  get_filename_component(folder ${folder} DIRECTORY)
  get_filename_component(floor ${folder} NAME)
  list(APPEND DOPPEL_FLOORS_OF_TOOLS ${floor})
endforeach()
list(REMOVE_DUPLICATES DOPPEL_FLOORS_OF_TOOLS)
list(JOIN DOPPEL_FLOORS_OF_TOOLS " " DOPPEL_FLOORS_OF_TOOLS)
