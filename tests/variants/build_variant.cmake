# cmake -D preset= -D source= -D build= -D native= -D targets=a,b -D run= -D flags= -P: see add_variant.
include(ProcessorCount)
ProcessorCount(cores)
if(DEFINED ENV{CMAKE_BUILD_PARALLEL_LEVEL})
  set(cores $ENV{CMAKE_BUILD_PARALLEL_LEVEL})
endif()

# Runs a command, its output as it comes; when it fails, so does this test.
function(step what)
  execute_process(COMMAND ${ARGN} WORKING_DIRECTORY ${source} RESULT_VARIABLE result)
  if(NOT result EQUAL 0)
    list(JOIN ARGN " " command)
    message(FATAL_ERROR "${what} failed for the preset ${preset} (${result}). To repeat it, in ${source}:\n  ${command}")
  endif()
endfunction()

if(preset STREQUAL "windows")
  # One server for all programs: else it ends with each of them, and now and then while the next one calls it. A first
  # program starts what runs beside the others, which must not hold on to their output.
  execute_process(COMMAND sh -c "wineserver -p600; wine cmd /c exit" OUTPUT_FILE /dev/null ERROR_FILE /dev/null)
  set(like -DJOSTLE_NATIVE_TOOL=${native})
endif()
if(preset MATCHES "^[at]san$")
  set(ENV{JOSTLE_SOAK_SECONDS} 60) # elsewhere it takes some seconds
endif()
if(flags)
  set(flags "-DCMAKE_CXX_FLAGS_RELEASE=${flags}" -DCMAKE_UNITY_BUILD=ON)
endif()
step("Configuring" ${CMAKE_COMMAND} --preset ${preset} -B ${build} ${flags} ${like})
string(REPLACE "," ";" targets "${targets}")
step("Building" ${CMAKE_COMMAND} --build ${build} --target ${targets} --parallel ${cores})
if(run)
  if(only)
    set(only -R ${only})
  endif()
  if(except)
    set(except -E ${except})
  endif()
  if(preset STREQUAL "windows")
    # Now and then wine's server ends the connection of a program that has just begun.
    set(again --repeat until-pass:2)
  endif()
  step("Testing" ${CMAKE_CTEST_COMMAND} --test-dir ${build} -L ${run} ${only} ${except} -j ${cores} ${again} --output-on-failure --no-tests=error)
endif()
