# cmake -D compilers= -D include= -D scratch= -P: every public header compiles with nothing before it, without
# a warning, and for those who do without RTTI.
file(GLOB headers RELATIVE ${include} ${include}/jostle/*.hpp ${include}/jostle/*.h)
if(NOT headers)
  message(FATAL_ERROR "No headers in ${include}/jostle")
endif()
foreach(header IN LISTS headers)
  set(lines "#include \"${header}\"\n#include \"${header}\"\n")
  file(WRITE ${scratch}/header.cpp "${lines}")
  foreach(compiler IN LISTS compilers)
    execute_process(RESULT_VARIABLE result COMMAND ${compiler} -std=c++20 -fsyntax-only -fno-rtti
      -Wall -Wextra -Wconversion -Wshadow -Wpedantic -Werror -I${include} ${scratch}/header.cpp)
    if(NOT result EQUAL 0)
      message(SEND_ERROR "${header} doesn't compile on its own with ${compiler}: ${result}")
    endif()
  endforeach()
endforeach()
list(LENGTH headers count)
message(STATUS "${count} headers checked")
