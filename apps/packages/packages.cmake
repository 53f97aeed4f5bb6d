# SPDX-License-Identifier: BSD-3-Clause
# What `cpack` makes in the build folder, docs/packages.md: Debian packages, one a component. The archive for other
# systems comes from release.sh.
set(CPACK_GENERATOR DEB)
# A build with CUDA makes packages of other names, which take the place of those without: NVIDIA's license is not one
# that everybody may hand on (docs/licenses.md), and most machines have no use for its size.
set(with_cuda "")
set(about_cuda "")
if(RETINT_HAVE_CUDA)
  set(with_cuda -cuda)
  set(about_cuda " It also runs on GPUs of NVIDIA.")
endif()
set(CPACK_PACKAGE_NAME retint${with_cuda})
set(CPACK_PACKAGE_VENDOR "The Retint authors")
set(CPACK_PACKAGE_CONTACT "The Retint authors <retint@users.noreply.github.com>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "recolor regions of 3D Gaussian Splatting scenes")
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
set(CPACK_VERBATIM_VARIABLES ON)

set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

set(about "Retint recolors a region of a 3D Gaussian Splatting scene: paint a mask on one
photo of its COLMAP workspace, and only the colors of the Gaussians that it
touches are fitted anew.")

# retint_package(COMPONENT PACKAGE SECTION DETAILS [DEPENDS]): in the scope of the caller.
macro(retint_package component plain section details)
  string(TOUPPER ${component} upper)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  set(package ${plain}${with_cuda})
  if(RETINT_HAVE_CUDA AND "${plain}" STREQUAL "libretint-dev")
    set(package libretint-cuda-dev)  # Debian's order of words
  endif()
  if(RETINT_HAVE_CUDA)
    foreach(relation PROVIDES CONFLICTS REPLACES)
      set(CPACK_DEBIAN_${upper}_PACKAGE_${relation} ${plain})
    endforeach()
  endif()
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${package})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${about}\n\n${details}${about_cuda}")
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS "${ARGN}")
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION share/doc/${package} RENAME copyright COMPONENT ${component})
  install(FILES ${PROJECT_BINARY_DIR}/changelog.Debian.gz DESTINATION share/doc/${package} COMPONENT ${component})
endmacro()

set(CPACK_COMPONENTS_ALL)
retint_package(cli retint graphics
  "This package has the command line and the documents.")
# Help names pages such as docs/scale.md.
install(DIRECTORY docs/ DESTINATION share/doc/retint${with_cuda}/docs COMPONENT cli)
retint_package(dev libretint-dev libdevel
  "This package has the static libraries, their headers and find_package(Retint)."
  "libeigen3-dev, libglm-dev, libtbb-dev, libhwy-dev, libopencv-dev, libceres-dev, libpcl-dev, libfmt-dev, nlohmann-json3-dev, libopencolorio-dev, libjpeg62-turbo-dev, zlib1g-dev, libzstd-dev, libwebp-dev, libzip-dev")
if(RETINT_VIEWER)
  retint_package(viewer retint-viewer graphics
    "This package has the editor." "hicolor-icon-theme, libqt6svg6")
endif()
if(RETINT_PYTHON)
  # The module is of one version of Python.
  math(EXPR Python_NEXT_MINOR "${Python_VERSION_MINOR} + 1")
  retint_package(python python3-retint python
    "This package has the Python module." "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), python3 (<< ${Python_VERSION_MAJOR}.${Python_NEXT_MINOR}), python3-numpy")
endif()

# The time is fixed, so that equal trees make equal packages.
file(WRITE ${PROJECT_BINARY_DIR}/changelog.Debian "retint (${PROJECT_VERSION}-1) unstable; urgency=medium

  * Version ${PROJECT_VERSION}.

 -- ${CPACK_PACKAGE_CONTACT}  Thu, 01 Jan 2026 00:00:00 +0000
")
execute_process(COMMAND gzip -9nkf changelog.Debian WORKING_DIRECTORY ${PROJECT_BINARY_DIR} COMMAND_ERROR_IS_FATAL ANY)
include(CPack)
