# SPDX-License-Identifier: BSD-3-Clause
retint_test(retint_mask_editor_test
  SOURCES selection_mask_editor_test.cc
  LINK retint_mask_editor)

# Qt Test: an executable a test, under the offscreen platform. One event loop at a time is all that these need.
foreach(name selection_canvas_test selection_mode_test)
  add_executable(${name} ${name}.cc)
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE retint_viewer Qt6::Test retint_warnings)
  set_target_properties(${name} PROPERTIES AUTOMOC ON)
  add_test(NAME ${name} COMMAND ${name})
  set_tests_properties(${name} PROPERTIES TIMEOUT ${RETINT_TEST_TIMEOUT} ENVIRONMENT "QT_QPA_PLATFORM=offscreen;QTEST_FUNCTION_TIMEOUT=${RETINT_TEST_TIMEOUT}000")
endforeach()
