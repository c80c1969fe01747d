# Precompiled headers and units. The third-party headers that nearly every file includes are compiled once (precompiled
# headers), and up to DOPPEL_JOINED files of a target are compiled as one unit, so that headers are read and templates
# instantiated once per unit. tools/build_cost prints what each unit costs.
#
# An edited file is compiled separately: tools/build appends the files that have changed since the last build to
# edited_sources.txt in the build folder. The other files of its unit are compiled once more, but not after later edits of it.
#
#   doppel_units(TARGET library|outer|test)       outer: code that never runs in the control loop
include_guard()

set(DOPPEL_JOINED 8 CACHE STRING "Files that are compiled as one unit; 1: each by itself")
option(DOPPEL_PRECOMPILED "Precompile the headers of other people that nearly every file includes" ON)

# One set for each kind of code: a precompiled header is valid only for the options that it was compiled with. All code is
# position-independent, so that libraries and programs share a set; -O1 compiles in three quarters of the time of -O2.
function(doppel_precompiled kind)
  if(TARGET doppel_precompiled_${kind})
    return()
  endif()
  set(source ${PROJECT_BINARY_DIR}/precompiled_${kind}.cpp)
  file(GENERATE OUTPUT ${source} CONTENT "")
  add_library(doppel_precompiled_${kind} OBJECT ${source})
  doppel_options(doppel_precompiled_${kind} ${kind})
  target_link_libraries(doppel_precompiled_${kind} PRIVATE doppel_flags Eigen3::Eigen fmt::fmt)
  if(kind STREQUAL outer)
    find_package(nlohmann_json REQUIRED)
    target_link_libraries(doppel_precompiled_outer PRIVATE nlohmann_json::nlohmann_json)
  endif()
  if(kind STREQUAL test)
    target_link_libraries(doppel_precompiled_${kind} PRIVATE GTest::gtest GTest::gmock)
  endif()
  target_precompile_headers(doppel_precompiled_${kind} PRIVATE ${PROJECT_SOURCE_DIR}/cmake/precompiled/${kind}.h)
endfunction()

function(doppel_options target kind)
  set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE OFF)  # ON would be -fPIE for programs
  target_compile_options(${target} PRIVATE -fPIC)
  if(NOT kind STREQUAL library AND NOT DOPPEL_SANITIZE AND NOT DOPPEL_FUZZ)
    target_compile_options(${target} PRIVATE -O1)
  elseif(kind STREQUAL test AND DOPPEL_SANITIZE)
    target_compile_options(${target} PRIVATE -O0)  # overrides -O1: the library is what is judged, and compiling takes half the time
  endif()
endfunction()

function(doppel_units target kind)
  doppel_options(${target} ${kind})
  if(DOPPEL_PRECOMPILED)
    doppel_precompiled(${kind})
    target_precompile_headers(${target} REUSE_FROM doppel_precompiled_${kind})
    target_compile_options(${target} PRIVATE $<$<CXX_COMPILER_ID:GNU>:-fpch-preprocess>)  # for ccache
  endif()
  doppel_join(${target})
endfunction()

if(NOT EXISTS ${PROJECT_BINARY_DIR}/edited_sources.txt)
  file(TOUCH ${PROJECT_BINARY_DIR}/edited_sources.txt)
endif()
file(STRINGS ${PROJECT_BINARY_DIR}/edited_sources.txt doppel_edited)
set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${PROJECT_BINARY_DIR}/edited_sources.txt)

# A file's unit is determined by its position in its folder's part of the list, so that no other unit changes when it
# leaves its unit. A unit has files of one folder only: names at file scope are unique within a module.
function(doppel_join target)
  if(NOT DOPPEL_JOINED GREATER 1)
    return()
  endif()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  get_target_property(sources ${target} SOURCES)
  set(place 0)
  set(folder)
  foreach(source IN LISTS sources)
    file(REAL_PATH ${source} path BASE_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR})
    file(RELATIVE_PATH path ${PROJECT_SOURCE_DIR} ${path})
    get_filename_component(parent ${path} DIRECTORY)
    if(NOT parent STREQUAL folder)
      set(folder ${parent})
      set(place 0)
      string(REGEX REPLACE "[^a-z0-9]" "_" group "${folder}")
    endif()
    math(EXPR unit "${place} / ${DOPPEL_JOINED}")
    math(EXPR place "${place} + 1")
    if(NOT path IN_LIST doppel_edited)
      set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group}_${unit})
    endif()
  endforeach()
endfunction()
