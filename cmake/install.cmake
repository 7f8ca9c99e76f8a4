# Installs the library so that find_package(jostle) and pkg-config find it, wherever the folder is moved to.
include(CMakePackageConfigHelpers)
# With the prefix /usr it is made for a Debian package, and nothing has to find anything from where it lies.
if(CMAKE_INSTALL_PREFIX MATCHES "^/usr/?$")
  set(jostle_for_system ON)
  set(jostle_doc_folder libjostle-dev)
else()
  set(jostle_for_system OFF)
  set(jostle_doc_folder jostle)
endif()

list(TRANSFORM jostle_parts PREPEND jostle_ OUTPUT_VARIABLE part_targets)
install(TARGETS jostle ${part_targets} jostle_bullet jostle_fcl EXPORT jostleTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT library)
install(DIRECTORY include/jostle extras/bullet/include/jostle extras/fcl/include/jostle DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development FILES_MATCHING PATTERN "*.h*")
if(NOT JOSTLE_HAS_MEMORY_RESOURCE)
  install(DIRECTORY include/missing DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/jostle COMPONENT development)
endif()
# What comments in the headers point to.
install(CODE "execute_process(COMMAND \"${CMAKE_COMMAND}\" -D \"SOURCE=${PROJECT_SOURCE_DIR}\"
  -D \"TO=\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATAROOTDIR}/doc/${jostle_doc_folder}\"
  -D \"INCLUDE=\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_INCLUDEDIR}\"
  -P \"${PROJECT_SOURCE_DIR}/cmake/install_docs.cmake\" COMMAND_ERROR_IS_FATAL ANY)" COMPONENT development)

# A static library hands on to its consumer what it is itself linked with; a shared one keeps that to itself.
set(jostle_find_dependencies "")
set(jostle_pc_requires "")
set(jostle_pc_libs "")
if(NOT BUILD_SHARED_LIBS)
  string(APPEND jostle_find_dependencies "find_dependency(Threads)\n")
  set(jostle_pc_libs " -pthread")
  # For programs in C and other languages, whose linkers know nothing of C++.
  set(jostle_cxx_runtime ${CMAKE_CXX_IMPLICIT_LINK_LIBRARIES})
  list(FILTER jostle_cxx_runtime INCLUDE REGEX "^(stdc\\+\\+|c\\+\\+|c\\+\\+abi|m)$")
  list(REMOVE_DUPLICATES jostle_cxx_runtime)
  foreach(library IN LISTS jostle_cxx_runtime)
    string(APPEND jostle_pc_libs " -l${library}")
  endforeach()
  if(JOSTLE_TBB)
    string(APPEND jostle_find_dependencies "find_dependency(TBB 2021 CONFIG)\n")
    list(APPEND jostle_pc_requires tbb)
  endif()
  if(JOSTLE_SIMD AND MSVC)
    string(APPEND jostle_find_dependencies "find_dependency(hwy 1.0.3 CONFIG)\n")
  endif()
  list(JOIN jostle_pc_requires ", " jostle_pc_requires)
endif()

set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/jostle)
install(EXPORT jostleTargets NAMESPACE jostle:: DESTINATION ${package_dir} COMPONENT development)
configure_package_config_file(cmake/jostleConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/jostleConfig.cmake
  INSTALL_DESTINATION ${package_dir})
# Before 1.0 a new minor version may change the interface.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/jostleConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/jostleConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/jostleConfigVersion.cmake
  DESTINATION ${package_dir} COMPONENT development)

# A component of its own: users of the library need neither MPI nor Zoltan.
if(TARGET jostle_mpi)
  install(TARGETS jostle_mpi EXPORT jostleMpiTargets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT library NAMELINK_COMPONENT development)
  install(FILES extras/mpi/include/jostle/mpi.hpp DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/jostle COMPONENT development)
  install(EXPORT jostleMpiTargets NAMESPACE jostle:: DESTINATION ${package_dir} COMPONENT development)
  install(FILES extras/mpi/zoltan.cmake DESTINATION ${package_dir} COMPONENT development)
endif()

file(RELATIVE_PATH jostle_pc_prefix ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
# jostle_install_pc(NAME DESCRIPTION LIBRARY...): those of the libraries for which a shared build has the one.
function(jostle_install_pc name description)
  set(libraries ${ARGN})
  if(BUILD_SHARED_LIBS)
    set(libraries jostle)
  endif()
  list(TRANSFORM libraries PREPEND "-l")
  list(JOIN libraries " " libraries)
  configure_file(cmake/jostle.pc.in ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()
jostle_install_pc(jostle "${PROJECT_DESCRIPTION}" jostle jostle_contacts jostle_world jostle_pairs)
jostle_install_pc(jostle-pairs "Which boxes touch" jostle_pairs)
jostle_install_pc(jostle-world "Boxes with identity, events and queries" jostle_world jostle_pairs)
jostle_install_pc(jostle-contacts "Contacts of shapes" jostle_contacts jostle_world jostle_pairs)
jostle_install_pc(jostle-chapter "The thesis chapter's algorithms, for study" jostle_chapter jostle_pairs)

# A part alone, with those that it needs: cmake --install build --component pairs, or world, or contacts. The whole has all of
# it as well, so these rules are for nobody else. A shared library is one, and so are Debian's packages of it.
if(NOT BUILD_SHARED_LIBS)
  # What each has for its users; and what that includes, which is added.
  set(headers_of_pairs find_pairs periodic neighbors process recorder responses)
  set(headers_of_world box_index pair_slots query spatial_order world)
  set(headers_of_contacts cast closed_mesh contact shape_query shapes surface)
  set(part_targets "")
  set(headers "")
  foreach(part pairs world contacts)
    list(APPEND part_targets jostle_${part})
    list(TRANSFORM headers_of_${part} REPLACE "(.+)" "${PROJECT_SOURCE_DIR}/include/jostle/\\1.hpp" OUTPUT_VARIABLE next)
    while(next)
      list(POP_FRONT next header)
      if(NOT header IN_LIST headers)
        list(APPEND headers ${header})
        file(STRINGS ${header} includes REGEX "^#include \"jostle/")
        list(TRANSFORM includes REPLACE "^#include \"(.*)\".*" "${PROJECT_SOURCE_DIR}/include/\\1")
        list(APPEND next ${includes})
      endif()
    endwhile()
    set(alone COMPONENT ${part} EXCLUDE_FROM_ALL)
    install(TARGETS ${part_targets} EXPORT jostle_${part}Targets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} ${alone})
    install(EXPORT jostle_${part}Targets NAMESPACE jostle:: DESTINATION ${package_dir} ${alone})
    install(FILES ${headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/jostle ${alone})
    if(NOT JOSTLE_HAS_MEMORY_RESOURCE)
      install(DIRECTORY include/missing DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/jostle ${alone})
    endif()
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/jostleConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/jostleConfigVersion.cmake
      DESTINATION ${package_dir} ${alone})
    list(TRANSFORM part_targets REPLACE "^jostle_(.*)$" "${CMAKE_CURRENT_BINARY_DIR}/jostle-\\1.pc" OUTPUT_VARIABLE pc_files)
    install(FILES ${pc_files} DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig ${alone})
    install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${jostle_doc_folder} ${alone})
  endforeach()
endif()

if(jostle_for_system AND BUILD_SHARED_LIBS)
  include(cmake/debian.cmake)
endif()
