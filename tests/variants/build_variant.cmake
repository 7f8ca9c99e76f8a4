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

step("Configuring" ${CMAKE_COMMAND} --preset ${preset} -B ${build})
string(REPLACE "," ";" targets "${targets}")
step("Building" ${CMAKE_COMMAND} --build ${build} --target ${targets} --parallel ${cores})
if(run)
  step("Testing" ${CMAKE_CTEST_COMMAND} --test-dir ${build} -L ${run} -j ${cores} --output-on-failure --no-tests=error)
endif()
