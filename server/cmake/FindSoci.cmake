# SOCI has no CMake config of its own in Debian 12: spinaltap::soci is its core with the SQLite back end.
find_path(SOCI_INCLUDE_DIR soci/soci.h)
find_library(SOCI_CORE_LIBRARY soci_core)
find_library(SOCI_SQLITE3_LIBRARY soci_sqlite3)
find_library(SOCI_SQLITE_LIBRARY sqlite3)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(Soci REQUIRED_VARS SOCI_INCLUDE_DIR SOCI_CORE_LIBRARY SOCI_SQLITE3_LIBRARY
  SOCI_SQLITE_LIBRARY)
if(Soci_FOUND AND NOT TARGET spinaltap::soci)
  add_library(spinaltap::soci INTERFACE IMPORTED)
  target_include_directories(spinaltap::soci SYSTEM INTERFACE ${SOCI_INCLUDE_DIR} ${SOCI_INCLUDE_DIR}/soci)
  target_link_libraries(spinaltap::soci INTERFACE ${SOCI_SQLITE3_LIBRARY} ${SOCI_CORE_LIBRARY} ${SOCI_SQLITE_LIBRARY})
endif()
