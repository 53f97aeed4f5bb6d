# SPDX-License-Identifier: BSD-3-Clause
# cmake -DBUILD=<build folder of apps/viewer> -DPREFIX=<scratch folder> -P install_test.cmake
file(REMOVE_RECURSE ${PREFIX})
execute_process(COMMAND ${CMAKE_COMMAND} --install ${BUILD} --prefix ${PREFIX}
  RESULT_VARIABLE failed OUTPUT_VARIABLE output ERROR_VARIABLE output)
if(failed)
  message(FATAL_ERROR "cmake --install: ${output}")
endif()
set(entry ${PREFIX}/share/applications/retint-viewer.desktop)
set(icon ${PREFIX}/share/icons/hicolor/scalable/apps/retint-viewer.svg)
foreach(file ${PREFIX}/bin/retint-viewer ${entry} ${icon} ${PREFIX}/share/man/man1/retint-viewer.1.gz)
  if(NOT EXISTS ${file})
    message(FATAL_ERROR "${file} was not installed")
  endif()
endforeach()
# The entry names the program and the icon that were installed.
file(READ ${entry} text)
foreach(line "Type=Application" "Icon=retint-viewer" "Exec=retint-viewer" "Categories=")
  if(NOT text MATCHES "\n${line}")
    message(FATAL_ERROR "${entry} has no ${line}")
  endif()
endforeach()
execute_process(COMMAND ${PREFIX}/bin/retint-viewer --help
  RESULT_VARIABLE failed OUTPUT_VARIABLE help ERROR_VARIABLE help)
if(failed OR NOT help MATCHES "--workspace")
  message(FATAL_ERROR "retint-viewer --help: ${failed} ${help}")
endif()
file(REMOVE_RECURSE ${PREFIX})
