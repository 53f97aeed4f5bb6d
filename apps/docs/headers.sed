# SPDX-License-Identifier: BSD-3-Clause
# Doxygen's view of a header: plain comments become documentation, in front of what they speak of or behind it.
s#^( *)// #\1/// #
\#^ */// #{
  s/</\\</g
  s/#/\\#/g
}
s#([;,{})]) +// #\1 ///< #
