# The target jostle::zoltan, where Zoltan is found. It is read by the build and, once installed, by find_package(jostle).
find_path(JOSTLE_ZOLTAN_INCLUDE zoltan.h PATH_SUFFIXES trilinos DOC "Where Zoltan's header is")
find_library(JOSTLE_ZOLTAN_LIBRARY NAMES trilinos_zoltan zoltan DOC "Zoltan's library")
if(JOSTLE_ZOLTAN_INCLUDE AND JOSTLE_ZOLTAN_LIBRARY AND NOT TARGET jostle::zoltan)
  add_library(jostle::zoltan INTERFACE IMPORTED)
  target_include_directories(jostle::zoltan SYSTEM INTERFACE ${JOSTLE_ZOLTAN_INCLUDE})
  target_link_libraries(jostle::zoltan INTERFACE ${JOSTLE_ZOLTAN_LIBRARY})
endif()
