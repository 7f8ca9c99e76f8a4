# Debian packages, by cpack in the build folder of the preset `package`: libjostle, libjostle-dev, jostle, python3-jostle.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME jostle)
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package has its own
set(CPACK_PACKAGE_CONTACT "${JOSTLE_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL library development tool python)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR})
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_POST_BUILD_SCRIPTS ${PROJECT_SOURCE_DIR}/cmake/repack.cmake)

set(same_version "libjostle (= ${PROJECT_VERSION}-1)")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_NAME libjostle)
set(CPACK_DEBIAN_LIBRARY_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY "=")
set(CPACK_DEBIAN_LIBRARY_PACKAGE_CONTROL_EXTRA ${PROJECT_SOURCE_DIR}/packaging/debian/triggers)
set(CPACK_COMPONENT_LIBRARY_DESCRIPTION "parallel collision detection: which boxes touch
Jostle finds all pairs of touching axis-aligned boxes among millions
that move, and what follows from them: events, answers to rays and
regions, contacts of shapes, and sums per object that are the same on
any number of threads.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libjostle-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "${same_version}")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "parallel collision detection, for C++20 and C programs
Headers, what find_package and pkg-config need, and the guide of Jostle, a
library for collision detection.")
set(CPACK_DEBIAN_TOOL_PACKAGE_NAME jostle)
set(CPACK_DEBIAN_TOOL_PACKAGE_SECTION science)
set(CPACK_DEBIAN_TOOL_PACKAGE_DEPENDS "${same_version}")
set(CPACK_COMPONENT_TOOL_DESCRIPTION "which boxes of a file touch, and how fast that is found
The command of Jostle, a library for collision detection. It finds the
touching pairs of boxes, meshes and recordings in files, measures on
this machine how fast that is, and simulates falling bodies.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-jostle)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "parallel collision detection over NumPy arrays
Pairs of touching boxes, worlds of moving objects, questions, contacts
of shapes and sums per object, over arrays that are read in place.")

# What Debian wants of each package: its copyright, and a changelog that gzip made without a date.
foreach(part library:libjostle development:libjostle-dev tool:jostle python:python3-jostle)
  string(REPLACE ":" ";" part ${part})
  list(GET part 0 component)
  list(GET part 1 package)
  if((component STREQUAL "tool" AND NOT JOSTLE_TOOL) OR (component STREQUAL "python" AND NOT JOSTLE_PYTHON_PACKAGE))
    list(REMOVE_ITEM CPACK_COMPONENTS_ALL ${component})
    continue()
  endif()
  set(folder ${PROJECT_BINARY_DIR}/debian/${package})
  configure_file(packaging/debian/changelog.in ${folder}/changelog.Debian @ONLY)
  execute_process(COMMAND gzip -9nf ${folder}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
  install(FILES packaging/debian/copyright ${folder}/changelog.Debian.gz DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package}
    COMPONENT ${component})
endforeach()
find_package(Python3 REQUIRED COMPONENTS Interpreter)
# What the packages were made of, read from the build.
install(CODE "execute_process(COMMAND \"${Python3_EXECUTABLE}\" -B \"${PROJECT_SOURCE_DIR}/packaging/sbom\" \"${PROJECT_BINARY_DIR}\"
  \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATAROOTDIR}/doc/libjostle-dev/jostle.spdx.json\"
  COMMAND_ERROR_IS_FATAL ANY)" COMPONENT development)
if(JOSTLE_PYTHON_PACKAGE)
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "${same_version}, python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA
    "${PROJECT_SOURCE_DIR}/packaging/debian/postinst;${PROJECT_SOURCE_DIR}/packaging/debian/prerm")
endif()
include(CPack)
