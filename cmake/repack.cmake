# Run by cpack when it has made the Debian packages: makes them again, by dpkg-deb, with all times no later than that of
# the release and everything in one order. So what was built twice is the same bytes.
if(DEFINED ENV{SOURCE_DATE_EPOCH})
  set(epoch $ENV{SOURCE_DATE_EPOCH})
else()
  file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/../packaging/debian/changelog.in date REGEX "^ -- ")
  string(REGEX REPLACE "^ -- .*  " "" date "${date}")
  execute_process(COMMAND date -u -d "${date}" +%s OUTPUT_VARIABLE epoch OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
endif()
foreach(package IN LISTS CPACK_PACKAGE_FILES)
  set(folder ${package}.d)
  file(REMOVE_RECURSE ${folder})
  execute_process(COMMAND dpkg-deb -R ${package} ${folder} COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND find ${folder} -exec touch --no-dereference --date=@${epoch} {} + COMMAND_ERROR_IS_FATAL ANY)
  execute_process(COMMAND ${CMAKE_COMMAND} -E env SOURCE_DATE_EPOCH=${epoch} dpkg-deb --root-owner-group -b ${folder} ${package}
    OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
  file(REMOVE_RECURSE ${folder})
endforeach()
