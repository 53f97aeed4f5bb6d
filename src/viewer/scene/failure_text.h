// SPDX-License-Identifier: BSD-3-Clause
// The text of an exception, for the user.
#pragma once

#include <exception>
#include <new>
#include <string_view>

#include <QCoreApplication>
#include <QString>

namespace retint {

// One line. If a device is out of memory, the exception's own text says how much is free; for the
// program's own memory, there is no such text.
inline QString FailureText(const std::exception& failure) {
  const bool plain = std::string_view(failure.what()) == std::bad_alloc().what();
  return plain ? QCoreApplication::translate("retint", "out of memory")
               : QString::fromUtf8(failure.what());
}

}  // namespace retint
