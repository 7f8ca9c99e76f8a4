# cmake -D library= -P: a shared libjostle shows names of namespace jostle's current version and of the C interface,
# and no others.
execute_process(COMMAND nm --dynamic --defined-only --format=posix ${library} OUTPUT_VARIABLE symbols
  RESULT_VARIABLE result)
if(NOT result EQUAL 0)
  message(FATAL_ERROR "nm can't read ${library}")
endif()
string(REGEX MATCHALL "[^\n]+" symbols "${symbols}")
list(LENGTH symbols count)
set(strangers ${symbols})
list(FILTER strangers EXCLUDE REGEX "^(_Z(T[VISH])?N[KR]?6jostle2v[0-9]+|jostle_[a-z0-9_]+ )")
if(strangers)
  list(JOIN strangers "\n  " strangers)
  message(FATAL_ERROR "Exported, but not from namespace jostle::v* or jostle.h:\n  ${strangers}")
endif()
if(count EQUAL 0)
  message(FATAL_ERROR "${library} exports nothing")
endif()
message(STATUS "${count} symbols checked")
