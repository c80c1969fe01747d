# A floor is a folder of src/doppel; a module is a folder of a floor: one static library `doppel_<module>` with headers and
# sources side by side (*.cpp), private headers in detail/ and tests in test/*.cpp.
#
#   doppel_floor(<floor> <modules, from the bottom up>)
#   doppel_module([OFF_LOOP] ABOUT "what it holds" [USES <floor>/<module> ...] [PUBLIC <libs>] [PRIVATE <libs>]
#     [FUZZ <what its fuzz targets link besides it>])
#   doppel_tests([PROGRAM <name>] [EXCEPT <files>] [LINKS <targets>] [DEFINES <definitions>] [NEEDS <targets>])
#
# USES is every module that its files include, no more and no less: tools/modules, part of ./test, checks the includes
# against it and generates the table and the pictures in docs from it.
#
# OFF_LOOP: no part of it runs in the control loop; it is compiled with -O1, in three quarters of the time.
#
# The tests of neighbouring floors are one program (doppel_test_program): linking is a large part of their cost. ctest runs a
# program as a few shards, since starting a program of tens of megabytes for each of thousands of tests takes minutes.
#
# A module's fuzz/*_fuzz.cpp are libFuzzer targets, built with DOPPEL_FUZZ (clang only): <module>_<name>_fuzz, with seed
# inputs in fuzz/corpus/<name>/. `./test --fuzz` runs them.
include_guard()

find_package(Threads REQUIRED)
find_package(fmt REQUIRED)
find_package(Eigen3 REQUIRED)
if(DOPPEL_TESTS)
  find_package(GTest REQUIRED)
  enable_testing()
  add_library(doppel_test_main OBJECT ${PROJECT_SOURCE_DIR}/cmake/test_main.cpp)
  target_link_libraries(doppel_test_main PUBLIC GTest::gtest GTest::gmock)
endif()

add_library(doppel_flags INTERFACE)
# g++ collects its garbage at 128 MB by default, which costs a tenth of the time; each unit needs 0.7 to 1.2 GB either way.
target_compile_options(doppel_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=400000>)
# g++ 12 reports overlaps and out-of-bounds accesses in std::string that do not exist (GCC bug 105651).
target_compile_options(doppel_flags INTERFACE -fvisibility=hidden -fvisibility-inlines-hidden
  -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual
  "$<$<CXX_COMPILER_ID:GNU>:-Wno-restrict;-Wno-array-bounds;-Wno-stringop-overflow>")
# g++ 13 and later take a reference to a cached object for one to an argument, and a vector in a returned struct for uninitialised.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_GREATER_EQUAL 13)
  target_compile_options(doppel_flags INTERFACE -Wno-dangling-reference -Wno-maybe-uninitialized)
endif()
if(DOPPEL_WERROR)
  target_compile_options(doppel_flags INTERFACE -Werror)
endif()
target_include_directories(doppel_flags INTERFACE ${PROJECT_SOURCE_DIR}/src ${PROJECT_BINARY_DIR}/generated)
target_compile_features(doppel_flags INTERFACE cxx_std_20)
if(DOPPEL_FUZZ)
  target_compile_options(doppel_flags INTERFACE -g -O1 -fno-omit-frame-pointer
    -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined)
  target_link_options(doppel_flags INTERFACE -fsanitize=address,undefined)
  add_custom_target(fuzz)
endif()

if(DOPPEL_SANITIZE)
  set(kinds ${DOPPEL_SANITIZE})
  set(kind_options -Wno-tsan)  # about fences, which it does not support: doppel transfers no data by a fence alone
  if(DOPPEL_SANITIZE STREQUAL "address")
    set(kinds address,undefined)
    # With Eigen these two checks take as long to build as all others; null dereferences are reported by AddressSanitizer.
    set(kind_options -fno-sanitize=null,alignment -fno-sanitize-recover=undefined)
  endif()
  target_compile_options(doppel_flags INTERFACE -g1 -O1 -fno-omit-frame-pointer -fsanitize=${kinds} ${kind_options})
  target_link_options(doppel_flags INTERFACE -fsanitize=${kinds})
else()
  # Everything is position-independent, for the engines. No function of doppel is replaced at load time, so they may
  # call each other directly, and be inlined.
  target_compile_options(doppel_flags INTERFACE -fno-semantic-interposition)
endif()

# No path of the build is part of the result, so that two builds of a version are equal byte for byte.
target_compile_options(doppel_flags INTERFACE -ffile-prefix-map=${PROJECT_SOURCE_DIR}=. -ffile-prefix-map=${PROJECT_BINARY_DIR}=build)

# What a fault in a parser of outside bytes can be used for is limited as in Debian's own packages.
if(NOT DOPPEL_SANITIZE AND NOT DOPPEL_FUZZ)
  target_compile_options(doppel_flags INTERFACE -fstack-protector-strong -fstack-clash-protection
    $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
  if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
    target_compile_options(doppel_flags INTERFACE -fcf-protection)
  elseif(CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
    target_compile_options(doppel_flags INTERFACE -mbranch-protection=standard)
  endif()
  target_link_options(doppel_flags INTERFACE LINKER:-z,relro LINKER:-z,now)
endif()

# A faster linker where one is installed: GNU ld takes 2 s for a test program and 1.5 s for the library, lld and mold 0.6 s.
find_program(DOPPEL_LINKER NAMES ld.mold ld.lld DOC "The linker; without it that of the compiler")
if(DOPPEL_LINKER)
  include(CheckLinkerFlag)
  string(REGEX REPLACE ".*ld\\." "-fuse-ld=" linker_option "${DOPPEL_LINKER}")
  check_linker_flag(CXX ${linker_option} DOPPEL_LINKER_WORKS)
  if(DOPPEL_LINKER_WORKS)
    target_link_options(doppel_flags INTERFACE ${linker_option})
  endif()
endif()

include(cmake/units.cmake)

function(doppel_floor floor)
  set_property(GLOBAL APPEND PROPERTY DOPPEL_FLOORS ${floor})
  add_library(doppel_floor_${floor} INTERFACE)
  add_library(doppel::${floor} ALIAS doppel_floor_${floor})  # for projects that contain this one
  foreach(module ${ARGN})
    add_subdirectory(${PROJECT_SOURCE_DIR}/src/doppel/${floor}/${module} ${PROJECT_BINARY_DIR}/src/doppel/${floor}/${module})
    if(TARGET doppel_${module})
      target_link_libraries(doppel_floor_${floor} INTERFACE doppel_${module})
    endif()
  endforeach()
endfunction()

function(doppel_module)
  cmake_parse_arguments(MODULE "OFF_LOOP" "ABOUT" "USES;PUBLIC;PRIVATE;FUZZ" ${ARGN})
  get_filename_component(MODULE_NAME ${CMAKE_CURRENT_SOURCE_DIR} NAME)
  file(GLOB sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} *.cpp)
  add_library(doppel_${MODULE_NAME} STATIC ${sources})
  if(MODULE_OFF_LOOP)
    doppel_units(doppel_${MODULE_NAME} outer)
  else()
    doppel_units(doppel_${MODULE_NAME} library)
  endif()
  set_property(GLOBAL APPEND PROPERTY DOPPEL_MODULES ${MODULE_NAME})
  list(TRANSFORM MODULE_USES REPLACE ".*/" "" OUTPUT_VARIABLE below)
  set_target_properties(doppel_${MODULE_NAME} PROPERTIES LINKER_LANGUAGE CXX DOPPEL_USES "${below}"
    DOPPEL_BORROWED "${MODULE_PUBLIC};${MODULE_PRIVATE}")  # for cmake/library.cmake
  target_link_libraries(doppel_${MODULE_NAME} PUBLIC doppel_flags ${MODULE_PUBLIC} PRIVATE ${MODULE_PRIVATE})
  set(simulates FALSE)
  if(MODULE_NAME STREQUAL "contract")
    set(simulates TRUE)
  endif()
  foreach(lower IN LISTS below)
    target_link_libraries(doppel_${MODULE_NAME} PUBLIC doppel_${lower})
    get_target_property(lower_simulates doppel_${lower} DOPPEL_SIMULATES)
    if(lower_simulates)
      set(simulates TRUE)
    endif()
  endforeach()
  set_target_properties(doppel_${MODULE_NAME} PROPERTIES DOPPEL_SIMULATES ${simulates})  # can load an engine
  if(DOPPEL_FUZZ)
    file(GLOB fuzz_sources CONFIGURE_DEPENDS fuzz/*_fuzz.cpp)
    foreach(source IN LISTS fuzz_sources)
      get_filename_component(stem ${source} NAME_WE)
      add_executable(${MODULE_NAME}_${stem} ${source})
      target_link_options(${MODULE_NAME}_${stem} PRIVATE -fsanitize=fuzzer)
      target_link_libraries(${MODULE_NAME}_${stem} PRIVATE doppel_${MODULE_NAME} ${MODULE_FUZZ} fmt::fmt)
      target_compile_definitions(${MODULE_NAME}_${stem} PRIVATE DOPPEL_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
      if(simulates)
        add_dependencies(${MODULE_NAME}_${stem} doppel_engines)
      endif()
      add_dependencies(fuzz ${MODULE_NAME}_${stem})
    endforeach()
  endif()
endfunction()

# A library that is loaded when it is first needed (core/plugin_module.h): lib/doppel/lib<NAME>.so. With OPTIONS of its own
# for the compiler it has no precompiled header, which is valid only for the options that it was compiled with.
function(doppel_plugin_module)
  cmake_parse_arguments(PLUGIN "OFF_LOOP" "NAME;MODULE" "SOURCES;LINKS;OPTIONS" ${ARGN})
  add_library(${PLUGIN_NAME} MODULE ${PLUGIN_SOURCES})
  if(PLUGIN_OPTIONS)
    doppel_options(${PLUGIN_NAME} library)
    target_compile_options(${PLUGIN_NAME} PRIVATE ${PLUGIN_OPTIONS})
    doppel_join(${PLUGIN_NAME})
  elseif(PLUGIN_OFF_LOOP)
    doppel_units(${PLUGIN_NAME} outer)
  else()
    doppel_units(${PLUGIN_NAME} library)
  endif()
  set_target_properties(${PLUGIN_NAME} PROPERTIES LIBRARY_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/lib/doppel)
  target_link_libraries(${PLUGIN_NAME} PRIVATE doppel_flags Eigen3::Eigen fmt::fmt ${PLUGIN_LINKS})
  set_property(GLOBAL APPEND PROPERTY DOPPEL_PLUGIN_MODULES ${PLUGIN_NAME})
  if(PLUGIN_MODULE)
    add_dependencies(doppel_${PLUGIN_MODULE} ${PLUGIN_NAME})
  endif()
endfunction()

# A physics engine: the plugin module doppel_engine_<NAME>, of all sources of its folder. The modules that it uses are
# linked into it and are not exported. Programs that simulate depend on `doppel_engines`.
add_custom_target(doppel_engines)
function(doppel_engine)
  cmake_parse_arguments(ENGINE "" "NAME" "USES;LINKS" ${ARGN})
  file(GLOB sources CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} *.cpp)
  list(TRANSFORM ENGINE_USES REPLACE ".*/" "doppel_")
  doppel_plugin_module(NAME doppel_engine_${ENGINE_NAME} SOURCES ${sources} LINKS ${ENGINE_LINKS} ${ENGINE_USES})
  add_dependencies(doppel_engines doppel_engine_${ENGINE_NAME})
  target_link_options(doppel_engine_${ENGINE_NAME} PRIVATE LINKER:--exclude-libs,ALL
    LINKER:-Bsymbolic-functions)
endfunction()

# The program that has the tests of a folder.
function(doppel_test_program folder out)
  set(${out} system_test PARENT_SCOPE)
  if(folder MATCHES "src/doppel/([a-z]+)/([a-z_]+)")
    set(floor ${CMAKE_MATCH_1})
    set(module ${CMAKE_MATCH_2})
    string(REGEX REPLACE "^robot$" "description" floor ${floor})
    string(REGEX REPLACE "^(lab|session)$" "twin" floor ${floor})
    if(floor STREQUAL "ros" AND module MATCHES "^(network|client|server|camera_feed|teleop)$")
      set(floor network)  # modules that open sockets
    endif()
    set(${out} ${floor}_test PARENT_SCOPE)
  endif()
endfunction()

# Processes that run a program's tests (default 1): each takes less than a minute.
set(doppel_shards_of network_test=2 physics_test=3 sensors_test=2 devices_test=2 twin_test=4 review_test=2 validation_test=4 system_test=8)
# Tests of two sides in real time run beside no other: a late answer would be a fault that they find. They are judged with the
# machine beside them: one that stood still meanwhile gives no evidence.
set(doppel_real_time ${PROJECT_SOURCE_DIR}/tests/real_time)
set(doppel_alone_of "system_test=MirrorTest.*:TopicTwin*")
# Floors below the twin, without a network: ./test --quick.
set(doppel_quick_programs base_test ros_test description_test physics_test sensors_test control_test devices_test scenario_test firmware_test)

function(doppel_add_shards program)
  set(shards 1)
  if("${doppel_shards_of}" MATCHES "${program}=([0-9]+)")
    set(shards ${CMAKE_MATCH_1})
  endif()
  math(EXPR last "${shards} - 1")
  set(filter)
  if("${doppel_alone_of}" MATCHES "${program}=([^;]+)")
    add_test(NAME ${program}.alone COMMAND ${doppel_real_time} $<TARGET_FILE:${program}> --gtest_brief=1 --gtest_filter=${CMAKE_MATCH_1})
    set_tests_properties(${program}.alone PROPERTIES TIMEOUT 900 COST 60 RUN_SERIAL ON)
    set(filter --gtest_filter=-${CMAKE_MATCH_1})
  endif()
  foreach(shard RANGE ${last})
    add_test(NAME ${program}.${shard} COMMAND ${program} --gtest_brief=1 ${filter})
    set_tests_properties(${program}.${shard} PROPERTIES TIMEOUT 900 COST 60
      ENVIRONMENT "GTEST_TOTAL_SHARDS=${shards};GTEST_SHARD_INDEX=${shard}")
    if(program IN_LIST doppel_quick_programs)
      set_tests_properties(${program}.${shard} PROPERTIES LABELS quick)
    endif()
  endforeach()
endfunction()

function(doppel_tests)
  if(NOT DOPPEL_TESTS)
    return()
  endif()
  cmake_parse_arguments(TESTS "" "PROGRAM" "SOURCES;EXCEPT;LINKS;DEFINES;NEEDS" ${ARGN})
  if(NOT TESTS_SOURCES)
    file(GLOB TESTS_SOURCES CONFIGURE_DEPENDS RELATIVE ${CMAKE_CURRENT_SOURCE_DIR} test/*.cpp)
  endif()
  foreach(source IN LISTS TESTS_EXCEPT)
    list(REMOVE_ITEM TESTS_SOURCES ${source})
  endforeach()
  list(TRANSFORM TESTS_SOURCES PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)
  if(CMAKE_CURRENT_SOURCE_DIR MATCHES "src/doppel/")
    get_filename_component(module ${CMAKE_CURRENT_SOURCE_DIR} NAME)
    list(APPEND TESTS_LINKS doppel_${module})
  endif()
  doppel_test_program(${CMAKE_CURRENT_SOURCE_DIR} program)
  if(TESTS_PROGRAM)
    set(program ${TESTS_PROGRAM})
  endif()
  set_property(GLOBAL APPEND PROPERTY DOPPEL_TEST_PROGRAMS ${program})
  set_property(GLOBAL APPEND PROPERTY ${program}_SOURCES ${TESTS_SOURCES})
  set_property(GLOBAL APPEND PROPERTY ${program}_LINKS ${TESTS_LINKS})
  set_property(GLOBAL APPEND PROPERTY ${program}_DEFINES ${TESTS_DEFINES})
  set_property(GLOBAL APPEND PROPERTY ${program}_NEEDS ${TESTS_NEEDS})
endfunction()

# Called once all modules are known. A program that can load an engine depends on the engines.
function(doppel_add_test_programs)
  get_property(programs GLOBAL PROPERTY DOPPEL_TEST_PROGRAMS)
  list(REMOVE_DUPLICATES programs)
  list(JOIN programs "\n" names)
  file(WRITE ${PROJECT_BINARY_DIR}/test_programs.txt "${names}\n")  # for tools/run_named_tests
  add_custom_target(quick DEPENDS ${doppel_quick_programs})
  foreach(program IN LISTS programs)
    foreach(field SOURCES LINKS DEFINES NEEDS)
      get_property(${field} GLOBAL PROPERTY ${program}_${field})
      list(REMOVE_DUPLICATES ${field})
    endforeach()
    add_executable(${program} ${SOURCES})
    doppel_units(${program} test)
    target_link_libraries(${program} PRIVATE ${LINKS} fmt::fmt doppel_test_main)
    target_compile_definitions(${program} PRIVATE DOPPEL_SOURCE_DIR="${PROJECT_SOURCE_DIR}" ${DEFINES})
    set_target_properties(${program} PROPERTIES ENABLE_EXPORTS ON)  # plugins find doppel's symbols in the program
    set(simulates FALSE)
    list(FILTER LINKS INCLUDE REGEX "^doppel_")
    foreach(module IN LISTS LINKS)
      get_target_property(lower_simulates ${module} DOPPEL_SIMULATES)
      if(lower_simulates)
        set(simulates TRUE)
      endif()
    endforeach()
    if(simulates)
      list(APPEND NEEDS doppel_engines)
    endif()
    if(NEEDS)
      add_dependencies(${program} ${NEEDS})
    endif()
    doppel_add_shards(${program})
  endforeach()
endfunction()
