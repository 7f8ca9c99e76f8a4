# Packages of which only headers are used, so that this machine's do for other systems as well.

# jostle_link_headers(FOUND FOLDER HEADER): for a cross build, a folder that has HEADER's alone, as a link, in the variable
# FOUND. What else lies beside them is this machine's, and must not be found.
function(jostle_link_headers found folder header)
  get_filename_component(name ${header} DIRECTORY)
  set(headers ${PROJECT_BINARY_DIR}/headers)
  file(MAKE_DIRECTORY ${headers})
  file(CREATE_LINK ${folder}/${name} ${headers}/${name} SYMBOLIC)
  set(${found} ${headers} PARENT_SCOPE)
endfunction()

# jostle_find_headers(PACKAGE VERSION TARGET HEADER): find_package, or in a cross build the same target from the links.
macro(jostle_find_headers package version target header)
  if(CMAKE_CROSSCOMPILING)
    if(NOT TARGET ${target})
      find_path(JOSTLE_${package}_INCLUDE ${header} PATHS /usr/local/include /usr/include NO_CMAKE_FIND_ROOT_PATH REQUIRED
        DOC "Where the headers of ${package} are: the folder that has ${header}")
      jostle_link_headers(jostle_linked_headers ${JOSTLE_${package}_INCLUDE} ${header})
      add_library(${target} INTERFACE IMPORTED)
      target_include_directories(${target} SYSTEM INTERFACE ${jostle_linked_headers})
    endif()
  else()
    find_package(${package} ${version} REQUIRED CONFIG)
  endif()
endmacro()
