# Installs the library so that find_package(jostle) and pkg-config find it, wherever the folder is moved to.
include(CMakePackageConfigHelpers)

install(TARGETS jostle EXPORT jostleTargets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(DIRECTORY include/jostle DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h*")
# What comments in the headers point to.
install(DIRECTORY docs/guide docs/images DESTINATION ${CMAKE_INSTALL_DOCDIR}/docs)

# A static library hands on to its consumer what it is itself linked with; a shared one keeps that to itself.
set(jostle_find_dependencies "")
set(jostle_pc_requires "")
set(jostle_pc_libs "-ljostle")
if(jostle_type STREQUAL "STATIC_LIBRARY")
  string(APPEND jostle_find_dependencies "find_dependency(Threads)\n")
  set(jostle_pc_libs "-ljostle -pthread")
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
install(EXPORT jostleTargets NAMESPACE jostle:: DESTINATION ${package_dir})
configure_package_config_file(cmake/jostleConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/jostleConfig.cmake
  INSTALL_DESTINATION ${package_dir})
# Before 1.0 a new minor version may change the interface.
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/jostleConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/jostleConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/jostleConfigVersion.cmake
  DESTINATION ${package_dir})

file(RELATIVE_PATH jostle_pc_prefix ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
configure_file(cmake/jostle.pc.in ${CMAKE_CURRENT_BINARY_DIR}/jostle.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/jostle.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
