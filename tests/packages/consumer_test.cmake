# SPDX-License-Identifier: BSD-3-Clause
# Installs the libraries into WORK and builds and runs a program against what was installed; the programs of PAGE,
# docs/cpp.md, are built too.
# -DBUILD=... -DWORK=... -DSOURCE=... -DPAGE=... -DCOMPILER=... -DVERSION=...
file(REMOVE_RECURSE ${WORK})
function(run)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE code)
  set(output "${output}" PARENT_SCOPE)
  set(code ${code} PARENT_SCOPE)
  if(NOT code EQUAL 0 AND NOT code EQUAL 2 AND NOT code EQUAL 3)
    message(FATAL_ERROR "${ARGN}:\n${output}")
  endif()
endfunction()

run(${CMAKE_COMMAND} --install ${BUILD} --component dev --prefix ${WORK}/first)
# Moved, so that nothing may hold on to where it was.
file(RENAME ${WORK}/first ${WORK}/moved)
foreach(header base/error.h editing/edit_session.h kernels/backend.h colmap_io/workspace.h)
  if(NOT EXISTS ${WORK}/moved/include/retint/${header})
    message(FATAL_ERROR "${header} is not installed")
  endif()
endforeach()
file(MAKE_DIRECTORY ${WORK}/page)
run(awk -v folder=${WORK}/page
  "/^```cpp/ { file = folder \"/page\" ++count \".cc\"\n next } /^```/ { file = \"\" } file { print > file }" ${PAGE})
run(${CMAKE_COMMAND} -S ${SOURCE}/consumer -B ${WORK}/build -DCMAKE_PREFIX_PATH=${WORK}/moved
  -DCMAKE_CXX_COMPILER=${COMPILER} -DPAGE=${WORK}/page)
run(${CMAKE_COMMAND} --build ${WORK}/build)
run(${WORK}/build/consumer)
if(NOT output STREQUAL "Retint ${VERSION}\n")
  message(FATAL_ERROR "the consumer said: ${output}")
endif()
run(${WORK}/build/consumer ${WORK}/none.ply)
if(NOT code EQUAL 3 OR NOT output MATCHES "none.ply")
  message(FATAL_ERROR "the consumer did not name the file that is missing: ${output}")
endif()
# Without arguments, a program of the page ends with 2.
foreach(number 1 2 3)
  run(${WORK}/build/page${number})
  if(NOT code EQUAL 2)
    message(FATAL_ERROR "program ${number} of ${PAGE} ended with ${code}: ${output}")
  endif()
endforeach()
string(REGEX MATCH "^[0-9]+\\.[0-9]+" minor ${VERSION})
file(READ ${PAGE} page)
if(NOT page MATCHES "find_package\\(Retint ${minor} REQUIRED\\)")
  message(FATAL_ERROR "${PAGE} asks for another version than ${minor}")
endif()
file(REMOVE_RECURSE ${WORK})
