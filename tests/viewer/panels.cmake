# SPDX-License-Identifier: BSD-3-Clause
# The panels in the real window. The scene on disk is that of the session's tests, which know GoogleTest.
retint_qt_test(panels_test)
target_link_libraries(panels_test PRIVATE GTest::gtest)
