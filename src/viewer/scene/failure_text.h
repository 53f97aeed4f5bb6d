// SPDX-License-Identifier: BSD-3-Clause
// What an exception says to the user.
#pragma once

#include <exception>
#include <new>
#include <string_view>

#include <QCoreApplication>
#include <QString>

namespace retint {

// One line. The memory of a device has a message of its own, which says how much is free; the
// program's own memory has none.
inline QString FailureText(const std::exception& failure) {
  const bool plain = std::string_view(failure.what()) == std::bad_alloc().what();
  return plain ? QCoreApplication::translate("retint", "out of memory")
               : QString::fromUtf8(failure.what());
}

}  // namespace retint
