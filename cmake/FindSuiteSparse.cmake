# Targets SuiteSparse::CHOLMOD and SuiteSparse::UMFPACK: from SuiteSparse's own configuration (7 and
# later), else from headers and libraries, as Debian 12 has them.
foreach(name CHOLMOD UMFPACK)
  find_package(${name} CONFIG QUIET)
  if(TARGET SuiteSparse::${name})
    set(SuiteSparse_${name}_FOUND TRUE)
    continue()
  endif()
  string(TOLOWER ${name} file)
  find_path(SuiteSparse_${name}_INCLUDE_DIR ${file}.h PATH_SUFFIXES suitesparse)
  find_library(SuiteSparse_${name}_LIBRARY ${file})
  mark_as_advanced(SuiteSparse_${name}_INCLUDE_DIR SuiteSparse_${name}_LIBRARY)
  if(SuiteSparse_${name}_INCLUDE_DIR AND SuiteSparse_${name}_LIBRARY)
    add_library(SuiteSparse::${name} UNKNOWN IMPORTED)
    set_target_properties(SuiteSparse::${name} PROPERTIES
      IMPORTED_LOCATION ${SuiteSparse_${name}_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${SuiteSparse_${name}_INCLUDE_DIR})
    set(SuiteSparse_${name}_FOUND TRUE)
  endif()
endforeach()
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(SuiteSparse
  REASON_FAILURE_MESSAGE "CHOLMOD and UMFPACK are in Debian's libsuitesparse-dev, and GRADPSI_WITH_CHOLMOD=OFF does without"
  HANDLE_COMPONENTS)
