# SPDX-License-Identifier: BSD-3-Clause
# RETINT_UNPACKED names the folder with headers that `apps/setup.sh --for demo` unpacked. Debian's libpcl-dev would
# install Java, Qt 5 and VTK too. This file defines the targets and variables of find_package(OpenCV) and
# find_package(PCL) that Retint uses.
function(retint_unpacked_library name include)
  # For example libopencv_core.so.4.6.0.
  file(GLOB library /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/lib${name}.so.*.*.*)
  set(folder ${RETINT_UNPACKED}/usr/include/${include})
  if(NOT library OR NOT EXISTS ${folder})
    message(FATAL_ERROR "lib${name} or ${folder} is missing: run apps/setup.sh --for demo")
  endif()
  list(GET library 0 library)
  add_library(${name} SHARED IMPORTED)
  set_target_properties(${name} PROPERTIES IMPORTED_LOCATION ${library}
    INTERFACE_INCLUDE_DIRECTORIES "${folder};${RETINT_UNPACKED}/usr/include")
  string(REGEX REPLACE ".*\\.so\\." "" version ${library})
  set(version ${version} PARENT_SCOPE)
endfunction()

foreach(module core imgproc imgcodecs calib3d)
  retint_unpacked_library(opencv_${module} opencv4)
endforeach()
set(OpenCV_VERSION ${version})
foreach(module common kdtree)
  retint_unpacked_library(pcl_${module} pcl-1.13)
endforeach()
set(PCL_VERSION ${version})
set(PCL_INCLUDE_DIRS ${RETINT_UNPACKED}/usr/include/pcl-1.13 ${RETINT_UNPACKED}/usr/include)
