# What the objects are linked with, in each folder that links them.
find_package(GTest REQUIRED) # the slow twins of the tests speak in its terms
find_package(zstd 1.4 REQUIRED CONFIG)
if(TARGET jostle_commands)
  find_package(CLI11 2.1 REQUIRED CONFIG)
  find_package(nlohmann_json 3.10 REQUIRED CONFIG)
  find_package(FastFloat REQUIRED CONFIG)
  find_package(assimp 5.2 REQUIRED CONFIG)
endif()
