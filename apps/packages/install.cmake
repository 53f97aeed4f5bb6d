# SPDX-License-Identifier: BSD-3-Clause
# The libraries for other C++ programs: headers, archives and find_package(Retint).
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)
set(folder lib/cmake/Retint)

# What the programs are made of stays theirs.
get_property(all GLOBAL PROPERTY RETINT_LIBRARIES)
set(libraries)
foreach(library ${all})
  get_target_property(source ${library} SOURCE_DIR)
  if(source MATCHES "^${PROJECT_SOURCE_DIR}/(apps|src/cluster|src/viewer)")
    continue()
  endif()
  list(APPEND libraries ${library})
  string(REGEX REPLACE "^retint_" "" exported ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${exported})
endforeach()
set_target_properties(retint_warnings PROPERTIES EXPORT_NAME warnings)
install(TARGETS ${libraries} retint_warnings EXPORT RetintTargets ARCHIVE DESTINATION lib COMPONENT dev)
install(EXPORT RetintTargets NAMESPACE Retint:: DESTINATION ${folder} COMPONENT dev)

# Headers lie as in the sources: "editing/edit_session.h" and "kernels/backend.h".
install(DIRECTORY src/ DESTINATION include/retint COMPONENT dev FILES_MATCHING PATTERN "*.h"
  PATTERN viewer EXCLUDE PATTERN cluster EXCLUDE PATTERN "*_json.h" EXCLUDE PATTERN json_node.h EXCLUDE)
install(DIRECTORY kernels colmap_io DESTINATION include/retint COMPONENT dev FILES_MATCHING PATTERN "*.h"
  PATTERN cpu EXCLUDE PATTERN cuda EXCLUDE)
install(FILES kernels/cpu/cpu_backend.h DESTINATION include/retint/kernels/cpu COMPONENT dev)
install(FILES kernels/cuda/cuda_backend.h DESTINATION include/retint/kernels/cuda COMPONENT dev)

set(RETINT_CONFIG_CUDA OFF)
if(RETINT_HAVE_CUDA)
  set(RETINT_CONFIG_CUDA ON)
endif()
configure_package_config_file(apps/packages/RetintConfig.cmake.in ${PROJECT_BINARY_DIR}/RetintConfig.cmake INSTALL_DESTINATION ${folder})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/RetintConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/RetintConfig.cmake ${PROJECT_BINARY_DIR}/RetintConfigVersion.cmake
  DESTINATION ${folder} COMPONENT dev)
