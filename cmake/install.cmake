# What `cmake --install` puts where: headers, library, what CMake and pkg-config need to find them, the
# program and its manual page.
include(CMakePackageConfigHelpers)
get_target_property(gradpsi_type gradpsi TYPE)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/gradpsi)

install(TARGETS gradpsi EXPORT gradpsiTargets)
install(DIRECTORY include/gradpsi DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  PATTERN petsc*.hpp EXCLUDE)
install(EXPORT gradpsiTargets NAMESPACE gradpsi:: DESTINATION ${package_dir})
if(GRADPSI_BUILD_APPS)
  file(RELATIVE_PATH from_program_to_library
    ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set_target_properties(gradpsi_program PROPERTIES INSTALL_RPATH $ORIGIN/${from_program_to_library})
  install(TARGETS gradpsi_program)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/apps/gradpsi.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
endif()
# A component, so that only who asks for it needs PETSc.
if(GRADPSI_WITH_PETSC)
  install(TARGETS gradpsi_petsc EXPORT gradpsiPetscTargets)
  install(FILES include/gradpsi/petsc.hpp include/gradpsi/petsc_partition.hpp
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/gradpsi)
  install(EXPORT gradpsiPetscTargets NAMESPACE gradpsi:: DESTINATION ${package_dir})
  if(GRADPSI_BUILD_APPS)
    set_target_properties(gradpsi_mpi PROPERTIES INSTALL_RPATH $ORIGIN/${from_program_to_library})
    install(TARGETS gradpsi_mpi)
  endif()
endif()
install(FILES LICENSE README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(cmake/gradpsiConfig.cmake.in gradpsiConfig.cmake
  INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(gradpsiConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES
  ${CMAKE_CURRENT_BINARY_DIR}/gradpsiConfig.cmake
  ${CMAKE_CURRENT_BINARY_DIR}/gradpsiConfigVersion.cmake
  cmake/FindSuiteSparse.cmake
  DESTINATION ${package_dir})

# A static library's users link what it is made with.
set(gradpsi_pc_libs "")
if(gradpsi_type STREQUAL "STATIC_LIBRARY")
  if(GRADPSI_WITH_CHOLMOD)
    string(APPEND gradpsi_pc_libs " -lcholmod -lumfpack")
  endif()
  string(APPEND gradpsi_pc_libs " ${OpenMP_CXX_FLAGS}")
  foreach(library ${CMAKE_DL_LIBS})
    string(APPEND gradpsi_pc_libs " -l${library}")
  endforeach()
endif()
set(pkgconfig_dir ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
file(RELATIVE_PATH gradpsi_pc_prefix
  ${CMAKE_INSTALL_PREFIX}/${pkgconfig_dir} ${CMAKE_INSTALL_PREFIX})  # so that the tree can be moved
cmake_path(APPEND gradpsi_pc_includedir "\${prefix}" ${CMAKE_INSTALL_INCLUDEDIR})
cmake_path(APPEND gradpsi_pc_libdir "\${prefix}" ${CMAKE_INSTALL_LIBDIR})
configure_file(cmake/gradpsi.pc.in gradpsi.pc @ONLY)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/gradpsi.pc DESTINATION ${pkgconfig_dir})
