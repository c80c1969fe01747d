# libdoppel.so: all modules as one shared library, for the program `doppel`, for other programs and for plug-ins. Tests
# link the modules themselves, because they use hidden functions.
include_guard()

add_library(doppel_library SHARED ${PROJECT_SOURCE_DIR}/src/doppel/version.cpp)
add_library(doppel::doppel ALIAS doppel_library)
set_target_properties(doppel_library PROPERTIES OUTPUT_NAME doppel EXPORT_NAME doppel VERSION ${PROJECT_VERSION}
  SOVERSION ${PROJECT_VERSION_MAJOR} LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib)
target_compile_options(doppel_library PRIVATE $<TARGET_PROPERTY:doppel_flags,INTERFACE_COMPILE_OPTIONS>)
target_compile_definitions(doppel_library PRIVATE DOPPEL_VERSION="${PROJECT_VERSION}")
target_compile_features(doppel_library PUBLIC cxx_std_20)
target_include_directories(doppel_library PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/src>
  $<BUILD_INTERFACE:${PROJECT_BINARY_DIR}/generated>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
target_link_libraries(doppel_library INTERFACE Eigen3::Eigen fmt::fmt Threads::Threads)
target_link_options(doppel_library PRIVATE LINKER:-Bsymbolic-functions LINKER:--no-undefined
  $<TARGET_PROPERTY:doppel_flags,INTERFACE_LINK_OPTIONS>)
get_property(modules GLOBAL PROPERTY DOPPEL_MODULES)
foreach(module IN LISTS modules)
  target_sources(doppel_library PRIVATE $<TARGET_OBJECTS:doppel_${module}>)
endforeach()
foreach(package yaml-cpp nlohmann_json Boost Qhull)  # the results of the modules' find_package are local to their folders
  find_package(${package} REQUIRED)
endforeach()
get_property(borrowed GLOBAL PROPERTY DOPPEL_BORROWED)
list(REMOVE_DUPLICATES borrowed)
target_link_libraries(doppel_library PRIVATE ${borrowed})
get_property(plugin_modules GLOBAL PROPERTY DOPPEL_PLUGIN_MODULES)
add_dependencies(doppel_library ${plugin_modules})
