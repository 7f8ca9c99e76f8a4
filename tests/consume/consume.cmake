# cmake -D source= -D scratch= -D how=find_package|pkg_config|subdirectory|tool [-D install=BUILD_FOLDER] [-D flags=] [-D with_mpi=ON]
#   -P consume.cmake
#
# Installs Jostle from its build folder and builds and runs the project beside this file with it, or runs the
# installed command.
set(project ${CMAKE_CURRENT_LIST_DIR}/project)
set(prefix ${scratch}/moved)
file(REMOVE_RECURSE ${scratch})
file(MAKE_DIRECTORY ${scratch})

function(step)
  execute_process(COMMAND ${ARGN} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "Failed (${result}): ${command}")
  endif()
endfunction()

if(install)
  # Moved afterwards: nothing installed may know where it was put.
  step(${CMAKE_COMMAND} --install ${install} --prefix ${scratch}/installed)
  file(RENAME ${scratch}/installed ${prefix})
endif()

if(how STREQUAL "tool")
  # What it plays must have moved with it: the source may be gone.
  execute_process(COMMAND ${prefix}/bin/jostle demo -n 1000 --frames 1 WORKING_DIRECTORY ${scratch}
    OUTPUT_VARIABLE output RESULT_VARIABLE result)
  if(NOT result EQUAL 0 OR NOT output MATCHES "^moved/share/jostle/tumble.jrec: 1,500 boxes.*\n  jostle pairs ")
    message(FATAL_ERROR "jostle demo (${result}) doesn't play the recording installed with it: ${output}")
  endif()
  return()
endif()

if(how STREQUAL "pkg_config")
  file(GLOB_RECURSE pc ${prefix}/jostle.pc)
  get_filename_component(pc_dir ${pc} DIRECTORY)
  get_filename_component(lib_dir ${pc_dir} DIRECTORY)
  set(ENV{PKG_CONFIG_PATH} ${pc_dir})
  execute_process(COMMAND pkg-config --cflags --libs jostle OUTPUT_VARIABLE flags RESULT_VARIABLE result
    OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT result EQUAL 0)
    message(FATAL_ERROR "pkg-config doesn't find jostle in ${pc_dir}")
  endif()
  separate_arguments(flags UNIX_COMMAND "${flags}")
  foreach(part pairs world contacts chapter)
    execute_process(COMMAND pkg-config --cflags --libs jostle-${part} OUTPUT_VARIABLE part_flags RESULT_VARIABLE result
      OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(NOT result EQUAL 0)
      message(FATAL_ERROR "pkg-config doesn't find jostle-${part} in ${pc_dir}")
    endif()
    separate_arguments(part_flags UNIX_COMMAND "${part_flags}")
    step(c++ -std=c++20 ${project}/${part}.cpp -o ${scratch}/${part} ${part_flags} -Wl,-rpath,${lib_dir})
    step(${scratch}/${part})
  endforeach()
  step(c++ -std=c++20 ${project}/stranger.cpp -o ${scratch}/stranger ${flags} -Wl,-rpath,${lib_dir})
  step(${scratch}/stranger)
  step(cc -std=c99 -pedantic ${project}_c/stranger.c -o ${scratch}/stranger_in_c ${flags} -Wl,-rpath,${lib_dir})
  step(${scratch}/stranger_in_c)
  return()
endif()

set(arguments -D CMAKE_BUILD_TYPE=None -D CMAKE_CXX_FLAGS=${flags})
if(how STREQUAL "find_package")
  list(APPEND arguments -D CMAKE_PREFIX_PATH=${prefix} -D WITH_MPI=${with_mpi})
else()
  list(APPEND arguments -D JOSTLE_SOURCE=${source} -D CMAKE_UNITY_BUILD=ON) # as some strangers' projects have it
endif()
step(${CMAKE_COMMAND} -S ${project} -B ${scratch}/build -G Ninja ${arguments})
step(${CMAKE_COMMAND} --build ${scratch}/build --parallel 2)
step(${CMAKE_CTEST_COMMAND} --test-dir ${scratch}/build --output-on-failure --no-tests=error)
if(how STREQUAL "find_package")
  step(${CMAKE_COMMAND} -S ${project}_c -B ${scratch}/build_c -G Ninja -D CMAKE_PREFIX_PATH=${prefix})
  step(${CMAKE_COMMAND} --build ${scratch}/build_c)
  step(${CMAKE_CTEST_COMMAND} --test-dir ${scratch}/build_c --output-on-failure --no-tests=error)
  # What isn't there is named.
  file(WRITE ${scratch}/missing/CMakeLists.txt "cmake_minimum_required(VERSION 3.20)\nproject(missing LANGUAGES CXX)\n"
    "find_package(jostle REQUIRED COMPONENTS grains)\n")
  execute_process(COMMAND ${CMAKE_COMMAND} -S ${scratch}/missing -B ${scratch}/missing/build -D CMAKE_PREFIX_PATH=${prefix}
    RESULT_VARIABLE result OUTPUT_QUIET ERROR_VARIABLE told)
  if(result EQUAL 0 OR NOT told MATCHES "no component grains")
    message(FATAL_ERROR "find_package of a component that there isn't (${result}) says: ${told}")
  endif()
endif()
