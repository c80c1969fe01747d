# What an installation consists of, in four components, which are Debian's packages (cmake/packages.cmake): the program, the
# library with its plugin modules, what programs of others are built with, and the data.
include(CMakePackageConfigHelpers)

set(doppel_datadir ${CMAKE_INSTALL_DATADIR}/doppel)
set(doppel_cmakedir ${CMAKE_INSTALL_LIBDIR}/cmake/doppel)
get_property(plugin_modules GLOBAL PROPERTY DOPPEL_PLUGIN_MODULES)

# The program finds its library from its own place, so that an installation can be moved as a whole.
file(RELATIVE_PATH library_from_program /${CMAKE_INSTALL_BINDIR} /${CMAKE_INSTALL_LIBDIR})
set_target_properties(doppel PROPERTIES INSTALL_RPATH "$ORIGIN/${library_from_program}")
install(TARGETS doppel RUNTIME COMPONENT program)

install(TARGETS doppel_library EXPORT doppel LIBRARY COMPONENT library NAMELINK_COMPONENT development)
install(TARGETS ${plugin_modules} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/doppel COMPONENT library)

# The public headers lie directly in the folders of their modules; what they include of the folders below is their templates
# (tools/public_headers.py has the same rule, and tools/check_headers compares).
file(GLOB public_headers CONFIGURE_DEPENDS RELATIVE ${PROJECT_SOURCE_DIR}/src src/doppel/*.h src/doppel/*/*.h)
set(installed_headers)
while(public_headers)
  list(POP_FRONT public_headers header)
  list(APPEND installed_headers ${header})
  file(STRINGS src/${header} includes REGEX "^#include \"doppel/[a-z0-9_]+/[a-z0-9_]+/")
  foreach(line IN LISTS includes)
    string(REGEX REPLACE "^#include \"(.*)\".*$" "\\1" template ${line})
    if(NOT template IN_LIST installed_headers AND NOT template IN_LIST public_headers)
      list(APPEND public_headers ${template})
    endif()
  endforeach()
endwhile()
foreach(header IN LISTS installed_headers)
  get_filename_component(folder ${header} DIRECTORY)
  install(FILES src/${header} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${folder} COMPONENT development)
endforeach()
install(EXPORT doppel FILE doppelTargets.cmake NAMESPACE doppel:: DESTINATION ${doppel_cmakedir} COMPONENT development)
get_property(DOPPEL_COMPONENTS GLOBAL PROPERTY DOPPEL_MODULES)
list(JOIN DOPPEL_COMPONENTS " " DOPPEL_COMPONENTS)
file(RELATIVE_PATH DOPPEL_PC_PREFIX /${CMAKE_INSTALL_LIBDIR}/pkgconfig /)
configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/doppelConfig.cmake.in ${PROJECT_BINARY_DIR}/doppelConfig.cmake
  INSTALL_DESTINATION ${doppel_cmakedir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/doppelConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/doppelConfig.cmake ${PROJECT_BINARY_DIR}/doppelConfigVersion.cmake
  DESTINATION ${doppel_cmakedir} COMPONENT development)
configure_file(${CMAKE_CURRENT_LIST_DIR}/doppel.pc.in ${PROJECT_BINARY_DIR}/doppel.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/doppel.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)

install(DIRECTORY robots worlds datasheets DESTINATION ${doppel_datadir} COMPONENT data)
install(DIRECTORY web/dist/ DESTINATION ${doppel_datadir}/page COMPONENT data)

# The manual and completion, which the program writes itself.
set(manual ${PROJECT_BINARY_DIR}/manual)
add_custom_command(OUTPUT ${manual}/stamp
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${manual}
  COMMAND doppel man --into ${manual}/man1
  COMMAND sh -c "gzip -9n ${manual}/man1/*.1"
  COMMAND doppel completion bash > ${manual}/doppel
  COMMAND doppel completion zsh > ${manual}/_doppel
  COMMAND doppel completion fish > ${manual}/doppel.fish
  COMMAND ${CMAKE_COMMAND} -E touch ${manual}/stamp
  DEPENDS doppel COMMENT "Writing the manual" VERBATIM)
add_custom_target(doppel_manual ALL DEPENDS ${manual}/stamp)
install(DIRECTORY ${manual}/man1 DESTINATION ${CMAKE_INSTALL_MANDIR} COMPONENT program)
install(FILES ${manual}/doppel DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions COMPONENT program)
install(FILES ${manual}/_doppel DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions COMPONENT program)
install(FILES ${manual}/doppel.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d COMPONENT program)
foreach(package program=doppel library=libdoppel${PROJECT_VERSION_MAJOR} development=libdoppel-dev data=doppel-data)
  string(REPLACE "=" ";" package ${package})
  list(GET package 0 component)
  list(GET package 1 name)
  install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} RENAME copyright COMPONENT ${component})
endforeach()
