# cmake -D preset= -D source= -D build= -D targets=a,b -D run= -P: see add_variant.
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
endif()
step("Configuring" ${CMAKE_COMMAND} --preset ${preset} -B ${build})
string(REPLACE "," ";" targets "${targets}")
step("Building" ${CMAKE_COMMAND} --build ${build} --target ${targets} --parallel ${cores})
if(run)
  if(only)
    set(only -R ${only})
  endif()
  if(except)
    set(except -E ${except})
  endif()
  step("Testing" ${CMAKE_CTEST_COMMAND} --test-dir ${build} -L ${run} ${only} ${except} -j ${cores} --output-on-failure --no-tests=error)
endif()
